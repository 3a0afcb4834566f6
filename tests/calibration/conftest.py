"""Photographs that are made of a model, and the model itself."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

import optisense as ots
from optisense.calibration import Photographs, photograph_model

if TYPE_CHECKING:
    from optisense.optics import OpticalModel

PLACES = [(-4.0, 2.0), (3.0, -2.0), (0.5, 3.0)]
"""Surface coordinates (mm) of the presses."""

PHOTONS = 100_000
"""Photons of the light."""

SIZE = (160, 120)
"""Size (pixels) of the photographs."""

SMALL = (100, 75)
"""Size (pixels) of photographs that show the contacts well enough for a fit."""

SMALLER = (64, 48)
"""Size (pixels) of photographs that show well enough which light is dim or lies lower."""


@pytest.fixture(scope="session")
def mini() -> OpticalModel:
    """A GelSight Mini with a flat gel."""
    return ots.OpticalModel(ots.load("gelsight-mini-ideal"))


@pytest.fixture(scope="session")
def photographs(mini: OpticalModel) -> Photographs:
    """Three presses of it, as a camera with noise would take them."""
    balls = [ots.Contact(ots.Sphere(3.0), at=place, depth=0.6) for place in PLACES]
    return photograph_model(mini, balls, resolution=SIZE, photons=PHOTONS, seed=5)


@pytest.fixture(scope="session")
def small_photographs(mini: OpticalModel) -> Photographs:
    """The same presses in small photographs, which are compared and fitted in less time."""
    balls = [ots.Contact(ots.Sphere(3.0), at=place, depth=0.6) for place in PLACES]
    return photograph_model(mini, balls, resolution=SMALL, photons=PHOTONS, seed=5)
