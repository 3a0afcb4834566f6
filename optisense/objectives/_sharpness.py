"""Sharpness: the smallest detail on the skin that the camera resolves."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from optisense.design.lenses.film import PictureWindow
from optisense.objectives import _figures
from optisense.objectives._distortion import seen_footprints
from optisense.objectives.registry import objective

if TYPE_CHECKING:
    from optisense.objectives.evaluation import Evaluation

LEAST_CONTRAST = 0.1
"""Smallest contrast, relative to that of coarse lines, at which fine lines are resolved: the usual
10 per cent of a lens's modulation transfer function."""

LINE_OF_BLUR = math.pi / math.sqrt(2.0 * math.log(1.0 / LEAST_CONTRAST))
"""Width of the finest line, in standard deviations of a Gaussian blur: lines of width w keep
exp(-(pi s / w)^2 / 2) of their contrast (the Gaussian's Fourier transform at the period 2 w)."""


USUAL = (0.27, 0.059)
"""Line widths (mm) of the poorest and the best built-in sensor: GelSight360, ideal Mini."""


@objective(
    "sharpness",
    title="Sharpness",
    draw=_figures.draw_sharpness,
    beside=("pixel", "blur"),
    range=(0.0, math.inf),
    unit="mm",
    lower_is_better=True,
    rays_only=True,
    usual=USUAL,
    numbers=("pixel", "blur", "finest", "coarsest", "footprints"),
)
def sharpness(evaluation: Evaluation) -> tuple[float, dict[str, Any], dict[str, Any]]:
    """The width in mm of the finest lines on the skin that the camera resolves.

    The squared width is the sum of two squares: the longer side of the footprint of the camera's
    pixel, and the line width at which the lens's blur leaves a tenth of the contrast. The value is
    the mean over the skin that is seen.
    """
    rays = evaluation.checked_rays
    long, wide = seen_footprints(rays)
    known = np.isfinite(long)
    across = rays.hit.shape[1]
    pixel = long.astype(np.float64) * across / evaluation.design.camera.resolution[0]
    focus = evaluation.model.picture_chain.focus
    if focus is None:
        blur = np.zeros_like(pixel)
    else:
        blur = focus.in_pixels(PictureWindow.whole(*rays.hit.shape))[:-1, :-1] * long
    detail = np.hypot(pixel, LINE_OF_BLUR * blur)
    area = (long * wide)[known].astype(np.float64)

    def mean(values: Any) -> float:
        return float(np.average(values[known], weights=area))

    parts = {
        "pixel": mean(pixel),
        "blur": mean(blur),
        "finest": float(np.percentile(detail[known], 5.0)),
        "coarsest": float(np.percentile(detail[known], 95.0)),
        "footprints": int(np.count_nonzero(known)),
    }
    return mean(detail), parts, {"detail": detail}
