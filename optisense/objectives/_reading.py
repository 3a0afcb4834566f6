"""Reading: the error of a calibrated reader's normals on presses that it was not fitted to."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from optisense.objectives import _figures
from optisense.objectives._reader import (
    CAMERA_NOISE,
    NUMBERS,
    pixels_to_read,
    read_presses,
    summarise_places,
)
from optisense.objectives.registry import objective
from optisense.reading.tilts import angles_between

if TYPE_CHECKING:
    from optisense.objectives.evaluation import Evaluation


USUAL = (25.0, 2.4)
"""Errors (degrees) of the poorest and the best built-in sensor by `optisense evaluate`:
GelSight360, and the ideal GelSight Mini."""


@objective(
    "reading",
    title="Reading",
    draw=_figures.draw_reading,
    beside=("reading_nothing", "worst_place"),
    reads=pixels_to_read,
    range=(0.0, 180.0),
    unit="degrees",
    lower_is_better=True,
    usual=USUAL,
    numbers=(*NUMBERS, "level_skin"),
)
def reading(
    evaluation: Evaluation, *, camera_noise: float = CAMERA_NOISE
) -> tuple[float, dict[str, Any], dict[str, Any]]:
    """The error, in degrees, of the normals that a calibrated reader finds on presses that it was
    not fitted to.

    Each press is read by a reader calibrated with the other presses, from pictures with the
    camera's noise. The value is the median over places of the mean over the pixels of a contact.
    The median limits the effect of presses at the border of the view, where the other presses
    contain little information, unlike a real calibration.

    Args:
        camera_noise: standard deviation of the noise of all pictures, levels of 255.
    """
    places: list[dict[str, Any]] = []
    maps = []
    for each in read_presses(evaluation, camera_noise):
        angles = angles_between(each.normals, each.true_normals)
        before = each.press.before[each.grid].astype(np.float64)
        tilts = angles_between(before, each.true_normals)[each.mask]
        level = each.seen & ~each.mask
        places.append(
            {
                "place": each.press.place,
                "error": float(angles[each.mask].mean()),
                "reading_nothing": float(tilts.mean()),
                "level_skin": float(angles[level].mean()) if level.any() else 0.0,
                "pixels": int(each.mask.sum()),
            }
        )
        maps.append({"errors": np.where(each.mask, angles, np.nan), "middle": each.press.middle})
    value, parts = summarise_places(places)
    parts["level_skin"] = float(np.mean([place["level_skin"] for place in places]))
    return value, parts, {"maps": maps}
