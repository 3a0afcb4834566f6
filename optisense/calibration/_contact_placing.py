"""Places of the contacts in photographs, corrected by the pictures of a model.

A contact that is found in a photograph alone is off by a few pixels, which changes the response as
much as a good model's errors do.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from optisense.array_types import FloatArray
from optisense.calibration._gauss_newton import LayeredFit
from optisense.calibration.model_pictures import layered_pictures, matched_exposure
from optisense.calibration.photographs import Photographs
from optisense.calibration.seen_contacts import SeenContact
from optisense.kept_arrays import NOTHING_KEPT, KeptArrays

if TYPE_CHECKING:
    from optisense.optics import OpticalModel

FIT_WIDTH = 160
"""Width of the pictures of a fit, in pixels: a quarter of the pixels of those that are compared in
the end, and enough for the smooth responses of balls.
"""

MOST_PLACINGS = 6
"""Largest number of renderings by which a contact is placed. Two are enough for most contacts, but
at the edge of the picture each one moves a contact by half as much as the one before.
"""

SETTLED = 0.25
"""Change of a contact's position and radius, pixels of the fit, below which it is placed: the
photographs' noise hides smaller ones.
"""

WIDEST_CHANGE = 0.5
"""Largest change of the logarithm of a contact's radius at once, a factor of 1.6. Contacts that are
found in photographs are off by a tenth; a larger change is a failure of the fit."""


def placed(
    model: OpticalModel,
    photographs: Photographs,
    seen: Sequence[SeenContact],
    *,
    photons: int,
    seed: int,
    exposure: float | None = None,
    kept: KeptArrays = NOTHING_KEPT,
) -> list[SeenContact]:
    """Return the contacts where the model's responses are closest to the photographs', which have
    the size of a fit.

    The exposure is a factor on the radiance; if None, it brings the background closest. A contact
    that is not on the model's skin raises CalibrationError.
    """
    found = list(seen)
    moving = list(range(len(found)))
    none: FloatArray = np.zeros(0)
    for _ in range(MOST_PLACINGS):
        some, places = photographs.subset(moving), [found[index] for index in moving]
        layers = layered_pictures(model, some, places, photons, seed, kept=kept)
        if exposure is None:
            total = layers.background.sum(axis=0)
            exposure = matched_exposure(total, layers.chain, photographs.background)
        fit = LayeredFit(some, places, layers, [], exposure, none, {})
        solution = fit.solve(none, np.zeros((len(places), 3)))
        for index, place, amount in zip(moving, places, solution.contacts, strict=True):
            found[index] = moved_contact(place, amount)
        moving = [
            index
            for index, place in zip(moving, places, strict=True)
            if _change(place, found[index]) >= SETTLED
        ]
        if not moving:
            break
    return found


def _change(one: SeenContact, other: SeenContact) -> float:
    """Return the larger change of position and radius, pixels."""
    return max(math.dist(one.centre, other.centre), abs(one.radius - other.radius))


def scaled_contact(place: SeenContact, factor: float) -> SeenContact:
    """Return a contact in a picture whose width is multiplied by a factor."""
    column, row = place.centre
    return SeenContact((column * factor, row * factor), place.radius * factor)


def moved_contact(place: SeenContact, amount: FloatArray) -> SeenContact:
    """Return a contact after a change (3,) of column, row (pixels) and the radius's logarithm."""
    column, row, wider = (float(value) for value in amount)
    grown = place.radius * math.exp(min(max(wider, -WIDEST_CHANGE), WIDEST_CHANGE))
    return SeenContact((place.centre[0] + column, place.centre[1] + row), grown)
