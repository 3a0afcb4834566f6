"""Compare a design with photographs of the real sensor."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from optisense.calibration.model_pictures import ModelPictures, model_pictures
from optisense.calibration.photographs import Photographs
from optisense.calibration.reading_both_ways import realism_and_readings
from optisense.calibration.realism import Realism
from optisense.calibration.seen_contacts import SeenContact, doubts, seen_contacts
from optisense.errors import CalibrationError
from optisense.quality import PICTURE_PHOTONS

if TYPE_CHECKING:
    from optisense.optics import OpticalModel


@dataclass(frozen=True)
class Comparison:
    """A model beside photographs of the real sensor.

    Attributes:
        photographs: at the size at which they are compared, those without a contact left out.
        seen: where each shows its contact.
        pictures: of the model.
        realism: the figures.
        notes: what is doubtful about the photographs, one sentence each.
    """

    photographs: Photographs
    seen: tuple[SeenContact, ...]
    pictures: ModelPictures = field(repr=False)
    realism: Realism
    notes: tuple[str, ...]


def usable(
    photographs: Photographs, *, refine: bool = True
) -> tuple[Photographs, list[SeenContact], list[str]]:
    """The photographs at working size that show a contact, where they do, and what is doubtful.

    Args:
        photographs: as they were read.
        refine: whether labelled contacts are looked for near their labels too.

    Raises:
        CalibrationError: none shows a contact.
    """
    small = photographs.scaled()
    notes = [*small.warnings(), *doubts(small)]
    found = seen_contacts(small, refine=refine)
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
    """Press what photographs show into a model, and measure how far its pictures are from them.

    Args:
        model: of the sensor.
        photographs: of the real one.
        photons: to trace.
        seed: of the light.
        refine: whether labelled contacts are looked for near their labels too; hand labels are off
            by pixels.
        progress: called with the number of pictures that are rendered.

    Raises:
        CalibrationError: the photographs can't be compared with this design.
        OptiSenseError: the design can't be rendered.
    """
    kept, seen, notes = usable(photographs, refine=refine)
    pictures = model_pictures(model, kept, seen, photons=photons, seed=seed, progress=progress)
    figures = realism_and_readings(model, kept, seen, pictures)
    return Comparison(kept, tuple(seen), pictures, figures, tuple(notes))
