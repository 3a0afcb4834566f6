"""Photographs that are made of a model, and the model itself."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest

import optisense as ots
from optisense.calibration import Photographs, photograph_model
from optisense.calibration._fit_rounds import FitRounds
from optisense.calibration.comparing import usable
from optisense.calibration.model_pictures import LayeredPictures, layered_pictures
from optisense.calibration.quantities import designed
from optisense.calibration.quantity import FitQuantity
from optisense.calibration.result import FittedNumber, fitted_numbers, with_known_total
from optisense.calibration.seen_contacts import ContactFinder, SeenContact
from optisense.calibration.settings import CalibrationSettings
from optisense.design import SensorDesign
from optisense.kept_arrays import NOTHING_KEPT

if TYPE_CHECKING:
    from optisense.optics import OpticalModel

PLACES = [(-4.0, 2.0), (3.0, -2.0), (0.5, 3.0)]
"""Surface coordinates (mm) of the presses."""

BALLS = [ots.Contact(ots.Sphere(3.0), at=place, depth=0.6) for place in PLACES]
"""The presses."""

PHOTONS = 100_000
"""Photons of the light."""

SIZE = (160, 120)
"""Size (pixels) of the photographs."""

SMALL = (100, 75)
"""Size (pixels) of photographs that show the contacts well enough for a fit."""

SMALLER = (64, 48)
"""Size (pixels) of photographs that show well enough which light is dim or lies lower, and that
determine all numbers of the camera."""


@pytest.fixture(scope="session")
def mini() -> OpticalModel:
    """A GelSight Mini with a flat gel."""
    return ots.OpticalModel(ots.load("gelsight-mini-ideal"))


@pytest.fixture(scope="session")
def photographs(mini: OpticalModel) -> Photographs:
    """Three presses of it, as a camera with noise would take them."""
    return photograph_model(mini, BALLS, resolution=SIZE, photons=PHOTONS, seed=5)


@pytest.fixture(scope="session")
def small_photographs(mini: OpticalModel) -> Photographs:
    """The same presses in small photographs, which are compared and fitted in less time."""
    return photograph_model(mini, BALLS, resolution=SMALL, photons=PHOTONS, seed=5)


@pytest.fixture(scope="session")
def smaller_photographs(mini: OpticalModel) -> Photographs:
    """The same presses in photographs of the least size, for fits without renderings."""
    return photograph_model(mini, BALLS, resolution=SMALLER, photons=PHOTONS, seed=5)


@pytest.fixture(scope="session")
def seen(smaller_photographs: Photographs) -> list[SeenContact]:
    """The contacts in the smaller photographs."""
    found = [place for place in ContactFinder(smaller_photographs).contacts() if place is not None]
    assert len(found) == len(smaller_photographs.presses)
    return found


@pytest.fixture(scope="session")
def layers(
    mini: OpticalModel, smaller_photographs: Photographs, seen: list[SeenContact]
) -> LayeredPictures:
    """The layers of the smaller photographs; tests don't change them."""
    return layered_pictures(mini, smaller_photographs, seen, PHOTONS, 5)


def with_pictures(photographs: Photographs, pictures: Sequence[np.ndarray]) -> Photographs:
    """Return photographs with other levels (h, w, 3) of the background and of each press."""
    ground, *presses = (np.clip(np.round(each), 0, 255).astype(np.uint8) for each in pictures)
    pairs = zip(photographs.presses, presses, strict=True)
    return replace(
        photographs,
        background=ground,
        presses=tuple(replace(press, picture=picture) for press, picture in pairs),
    )


def numbers_of_fit(
    design: SensorDesign,
    photographs: Photographs,
    chosen: list[FitQuantity],
    settings: CalibrationSettings,
) -> list[FittedNumber]:
    """Return the numbers that `calibrate` finds, without its comparisons of the photographs with
    the designs before and after the fit, for which it renders both.
    """
    full, seen, _ = usable(photographs, refine=settings.refine)
    rounds = FitRounds(
        design, ots.OpticalModel(design), full, seen, chosen, settings, NOTHING_KEPT,
        lambda what, done, count: None,
    )  # fmt: skip
    solution = rounds.run()
    fitted = designed(design, chosen, solution.steps)
    return fitted_numbers(chosen, with_known_total(chosen, solution, fitted), fitted)
