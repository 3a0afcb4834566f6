"""Reading and depth: the errors of normals and of shape that a calibrated reader finds on presses
that it was not fitted to."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from optisense.array_types import FloatArray
from optisense.objectives import _figures
from optisense.objectives._reader import (
    CAMERA_NOISE,
    NUMBERS,
    ReadPress,
    pixels_to_read,
    read_presses,
    summarise_places,
)
from optisense.objectives.registry import objective
from optisense.reading.integration import NormalIntegrator
from optisense.reading.tilts import angles_between
from optisense.reading.untouched import UntouchedSurface

if TYPE_CHECKING:
    from optisense.objectives.evaluation import Evaluation


@objective(
    "reading",
    title="Reading",
    draw=_figures.draw_reading,
    beside=("reading_nothing", "worst_place"),
    reads=pixels_to_read,
    range=(0.0, 180.0),
    unit="degrees",
    lower_is_better=True,
    usual=(25.0, 2.4),  # GelSight360, ideal GelSight Mini
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


@objective(
    "depth",
    title="Depth",
    draw=_figures.draw_depth,
    beside=("reading_nothing", "worst_place"),
    reads=pixels_to_read,
    range=(0.0, math.inf),
    unit="mm",
    lower_is_better=True,
    numbers=NUMBERS,
)
def depth(
    evaluation: Evaluation, *, camera_noise: float = CAMERA_NOISE
) -> tuple[float, dict[str, Any], dict[str, Any]]:
    """The error, in mm, of the shape that a calibrated reader finds on presses that it was not
    fitted to.

    The normals of the objective `reading` are integrated to depth below the untouched surface. The
    value is the median over places of the mean absolute difference over the pixels of a contact.

    Args:
        camera_noise: standard deviation of the noise of all pictures, levels of 255.
    """
    places: list[dict[str, Any]] = []
    maps = []
    for each in read_presses(evaluation, camera_noise):
        integrator, true = each.press.derived(
            "integrator and depth", partial(_known, evaluation, each)
        )
        read = integrator.depths(each.normals)
        inside = each.mask
        places.append(
            {
                "place": each.press.place,
                "error": float(np.abs(read - true)[inside].mean()),
                "reading_nothing": float(true[inside].mean()),
                "deepest": float(true[inside].max()),
                "deepest_read": float(read[inside].max()),
                "pixels": int(inside.sum()),
            }
        )
        profiles = {"read": _along_middle(read, inside), "true": _along_middle(true, inside)}
        maps.append(profiles | {"middle": each.press.middle})
    value, parts = summarise_places(places)
    return value, parts, {"profiles": maps}


def _known(evaluation: Evaluation, read: ReadPress) -> tuple[NormalIntegrator, FloatArray]:
    """Return the integrator of normals on the grid of a press, and its true depth (h, w), mm."""
    rays = evaluation.shared(
        "rays of the images", lambda: evaluation.model.chief_rays(evaluation.resolution)
    )
    window = read.press.window
    box = (slice(None), slice(None)) if window is None else window.box
    surface = UntouchedSurface(
        points=rays.points[box][read.grid].astype(np.float64),
        normals=rays.normals[box][read.grid].astype(np.float64),
        directions=rays.directions[box][read.grid].astype(np.float64),
        seen=read.seen,
    )
    points = np.where(read.mask[..., None], read.press.points[read.grid], surface.points)
    return NormalIntegrator(surface), surface.depth(points)


def _along_middle(values: FloatArray, inside: NDArray[np.bool_]) -> FloatArray:
    """Return the values (w,), mm, along the row through the middle of a contact."""
    row = int(np.argmax(inside.sum(axis=1)))
    middle: FloatArray = values[row]
    return middle
