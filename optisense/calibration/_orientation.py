"""Notes on photographs that are mirrored, turned, or stored with red and blue exchanged."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from optisense.calibration.model_pictures import ModelPictures
from optisense.calibration.photographs import Photographs
from optisense.calibration.realism import PATCH, correlation
from optisense.calibration.seen_contacts import SeenContact

HALF_TURN = "turned by 180 degrees"

PLACINGS = {
    "": (1, 1),
    "mirrored left to right": (1, -1),
    "mirrored top to bottom": (-1, 1),
    HALF_TURN: (-1, -1),
}
"""Steps along rows and columns by which a picture is mirrored or turned, by the words for it."""

EXCHANGED = "stored with red and blue exchanged"
"""Words for pictures whose channels are in the reverse order."""

CLEARLY = 0.07
"""Difference of likenesses from which on another way of placing is noted: photographs of a GelSight
Mini that are mirrored left to right, which changes them least, have a difference of 0.10."""

ABOUT_EQUAL = 0.03
"""Difference of likenesses up to which a way is named beside the best one: a sensor whose lights
are placed symmetrically looks nearly the same mirrored and with exchanged colours."""

LEAST_LIKENESS = 0.5
"""Smallest likeness of the best way for a note; the right photographs have 0.97, and those of
another sensor are like the model in no way."""


def orientation_notes(
    photographs: Photographs, seen: Sequence[SeenContact], pictures: ModelPictures
) -> list[str]:
    """Return a note if the photographs are clearly more like the model's pictures of the same
    presses when they are mirrored, turned by 180 degrees, or their red and blue are exchanged.
    """
    found = _likenesses(photographs, seen, pictures)
    best = max(found.values())
    if best < max(LEAST_LIKENESS, found[""] + CLEARLY):
        return []
    ways = " or ".join(words for words, value in found.items() if value >= best - ABOUT_EQUAL)
    instead = ", or reverse camera.up of the design" if ways == HALF_TURN else ""
    return [
        f"the photographs seem to be {ways}: so changed, they have a likeness of {best:.2f} with "
        f"the model, and {found['']:.2f} as they are; correct the files and their labels{instead}"
    ]


def _likenesses(
    photographs: Photographs, seen: Sequence[SeenContact], pictures: ModelPictures
) -> dict[str, float]:
    """Return the likeness of photographs and model for each way of changing the photographs.

    The likeness is the mean of the correlation of the backgrounds and the median correlation of the
    responses about the contacts, where a response is mirrored about its contact's middle. The words
    for the photographs as they are are empty.
    """
    ground = photographs.background.astype(np.float64)
    boxes = [_box(place, photographs.size) for place in seen]
    responses = [
        (press.picture[box] - ground[box], shown[box] - pictures.background[box])
        for press, shown, box in zip(photographs.presses, pictures.presses, boxes, strict=True)
    ]
    found = {}
    for placing, (down, across) in PLACINGS.items():
        for colours, step in (("", 1), (EXCHANGED, -1)):
            change = np.s_[::down, ::across, ::step]
            of_ground = correlation(ground[change], pictures.background)
            of_responses = np.median([correlation(one[change], two) for one, two in responses])
            words = " and ".join(word for word in (placing, colours) if word)
            found[words] = 0.5 * (of_ground + float(of_responses))
    return found


def _box(seen: SeenContact, size: tuple[int, int]) -> tuple[slice, slice]:
    """Return the rows and columns about a contact, as far as both sides are in the picture."""
    columns, rows = (
        slice(max(round(middle - reach), 0), round(middle + reach))
        for middle, length in zip(seen.centre, size, strict=True)
        for reach in [max(min(PATCH * seen.radius, middle, length - middle), 1.0)]
    )
    return rows, columns
