"""Models of the built-in sensors, which the tests of all files share."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import pytest

from optisense import sensors
from optisense.optics import OpticalModel

ModelOf = Callable[[str], OpticalModel]
"""The model of a built-in sensor by its name."""


@pytest.fixture(scope="session")
def model_of() -> ModelOf:
    """Each model is made once; tests do not change it."""
    return cache(lambda name: OpticalModel(sensors.build(name)))
