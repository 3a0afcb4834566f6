"""Comparison of a design with photographs of the real sensor."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from optisense.calibration._contact_placing import FIT_WIDTH, placed, scaled_contact
from optisense.calibration._cross_readings import realism_and_readings
from optisense.calibration._orientation import orientation_notes
from optisense.calibration.model_pictures import ModelPictures, model_pictures
from optisense.calibration.photographs import Photographs
from optisense.calibration.realism import Realism
from optisense.calibration.seen_contacts import (
    ContactFinder,
    SeenContact,
    check_shape,
)
from optisense.errors import CalibrationError
from optisense.quality import PICTURE_PHOTONS

if TYPE_CHECKING:
    from optisense.optics import OpticalModel


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
