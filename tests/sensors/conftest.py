"""The model of a built-in sensor, which files of tests share."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from optisense import sensors
from optisense.optics import OpticalModel

ModelOf = Callable[[str], OpticalModel]
"""The model of a built-in sensor by its name."""


@pytest.fixture(scope="package")
def model_of() -> ModelOf:
    """Return a function that returns a model, which tests do not change.

    It keeps the model that it returned last, as each takes up to 0.9 GB.
    """
    kept: dict[str, OpticalModel] = {}

    def model(name: str) -> OpticalModel:
        if name not in kept:
            kept.clear()
            kept[name] = OpticalModel(sensors.build(name))
        return kept[name]

    return model
