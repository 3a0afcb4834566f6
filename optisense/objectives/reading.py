"""Reading: how far a calibrated reader's normals are off, on presses that it has not seen."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from optisense.objectives import figures
from optisense.objectives.reader import (
    CAMERA_NOISE,
    LEAST_PIXELS,
    LEAST_PRESSES,
    over_places,
    pixels_to_read,
    read_presses,
)
from optisense.objectives.registry import objective
from optisense.reading.tilts import angles_between

if TYPE_CHECKING:
    from optisense.objectives.evaluation import Evaluation


USUAL = (23.0, 2.8)
"""Degrees, of the poorest and the best built-in sensor: GelSight360, GelSight Mini."""


@objective(
    "reading",
    title="Reading",
    draw=figures.draw_reading,
    beside=("reading_nothing", "worst_place"),
    reads=pixels_to_read,
    range=(0.0, 180.0),
    needs=f"{LEAST_PRESSES} presses or more, each seen, with {LEAST_PIXELS} pixels",
    unit="degrees",
    lower_is_better=True,
    usual=USUAL,
)
def reading(
    evaluation: Evaluation, *, camera_noise: float = CAMERA_NOISE
) -> tuple[float, dict[str, Any], dict[str, Any]]:
    """How many degrees normals are off that a calibrated reader finds on presses new to it.

    Each press is read by a reader that the other presses have calibrated, from pictures with the
    camera's noise. The value is the median over places of the mean over the pixels of a contact: on
    the border of the view the others tell little of a press, which a calibration would have there.

    Args:
        evaluation: the sensor.
        camera_noise: standard deviation in levels of 255, on all pictures.
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
        maps.append({"errors": np.where(each.mask, angles, np.nan)})
    value, parts = over_places(places)
    parts["level_skin"] = float(np.mean([place["level_skin"] for place in places]))
    return value, parts, {"maps": maps}
