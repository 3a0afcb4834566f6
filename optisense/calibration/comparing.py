"""Comparison of a design with photographs of the real sensor, and the places of their contacts.

A contact that is found in a photograph alone is off by a few pixels, which changes the response as
much as a good model's errors do; so it is placed by the pictures of the model.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from optisense.array_types import FloatArray
from optisense.calibration._cross_readings import realism_and_readings
from optisense.calibration._gauss_newton import LayeredFit
from optisense.calibration._orientation import orientation_notes
from optisense.calibration.model_pictures import (
    ModelPictures,
    layered_pictures,
    matched_exposure,
    model_pictures,
)
from optisense.calibration.photographs import Photographs
from optisense.calibration.realism import Realism
from optisense.calibration.seen_contacts import (
    ContactFinder,
    SeenContact,
    check_shape,
)
from optisense.errors import CalibrationError
from optisense.kept_arrays import NOTHING_KEPT, KeptArrays
from optisense.quality import PICTURE_PHOTONS

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


@dataclass(frozen=True)
class Comparison:
    """Comparison of a model with photographs of the real sensor.

    Attributes:
        photographs: photographs at the size of the comparison, without those that show no contact.
        seen: contact in each photograph.
        pictures: pictures of the model.
        realism: figures of the comparison.
        notes: doubtful findings about the photographs, one sentence each.
    """

    photographs: Photographs
    seen: tuple[SeenContact, ...]
    pictures: ModelPictures = field(repr=False)
    realism: Realism
    notes: tuple[str, ...]


def usable(
    photographs: Photographs, *, refine: bool = True
) -> tuple[Photographs, list[SeenContact], list[str]]:
    """Return the photographs at working size that show a contact, their contacts, and doubtful
    findings; CalibrationError is raised if none shows a contact.

    `refine` says whether labelled contacts are searched near their labels too.
    """
    small = photographs.scaled()
    finder = ContactFinder(small)
    notes = [*small.warnings(), *finder.doubts()]
    found = finder.contacts(refine=refine)
    kept = [index for index, place in enumerate(found) if place is not None]
    if not kept:
        raise CalibrationError(
            "none of the photographs shows a contact",
            hint="Check that the background is of the same sensor and shows nothing pressed in",
        )
    return small.subset(kept), [place for place in found if place is not None], notes


def compare(
    model: OpticalModel,
    photographs: Photographs,
    *,
    photons: int = PICTURE_PHOTONS,
    seed: int = 0,
    refine: bool = True,
    progress: Callable[[int], None] = lambda done: None,
) -> Comparison:
    """Press the contacts of photographs into a model, and measure the differences of the pictures.

    Args:
        model: model of the sensor.
        photographs: photographs of the real sensor.
        photons: number of photons.
        seed: seed of the light.
        refine: whether contacts are placed where the model's responses are closest to the
            photographs', also labelled ones; hand labels are off by pixels.
        progress: function that is called with the number of rendered pictures.

    Raises:
        CalibrationError: the photographs can't be compared with this design.
        OptiSenseError: the design can't be rendered.
    """
    kept, seen, notes = usable(photographs, refine=refine)
    if refine:
        check_shape(kept, model)
        small = kept.scaled(FIT_WIDTH)
        factor = small.size[0] / kept.size[0]
        found = [scaled_contact(place, factor) for place in seen]
        found = placed(model, small, found, photons=photons, seed=seed)
        seen = [scaled_contact(place, 1.0 / factor) for place in found]
    pictures = model_pictures(model, kept, seen, photons=photons, seed=seed, progress=progress)
    figures = realism_and_readings(model, kept, seen, pictures)
    notes += orientation_notes(kept, seen, pictures)
    return Comparison(kept, tuple(seen), pictures, figures, tuple(notes))


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
