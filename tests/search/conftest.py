"""Designs and spaces that searches are tested on; nothing here renders."""

from __future__ import annotations

import pytest

import optisense as ots
from optisense.design import SensorDesign
from optisense.search.space import BoundSpace, SearchSpace


@pytest.fixture(scope="session")
def mini() -> SensorDesign:
    return ots.load("gelsight-mini")


@pytest.fixture(scope="session")
def svelte() -> SensorDesign:
    return ots.load("gelsight-svelte")


@pytest.fixture(scope="session")
def two_numbers(mini: SensorDesign) -> BoundSpace:
    """Specularity and roughness-free: two numbers that no check ties to each other."""
    return SearchSpace(
        {"coating.specularity": (0.0, 1.0, 5), "camera.position.x": (-1.0, 3.0, 3)}
    ).bind(mini)


@pytest.fixture(scope="session")
def mixed(mini: SensorDesign) -> BoundSpace:
    """A number, a whole number and names."""
    group = next(iter(mini.lights))
    return SearchSpace(
        {
            "coating.specularity": (0.0, 1.0, 3),
            f"lights.{group}.colour": ["red", "green", "blue"],
            "camera.resolution[0]": (100, 104),
        }
    ).bind(mini)
