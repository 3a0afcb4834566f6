"""Distortion and sharpness: the shapes and sizes of the pixels' footprints on the sensing surface.

The chief rays of neighbouring pixels meet the surface at points P. The derivatives of P along a row
and along a column span the footprint of a pixel, which is a parallelogram. The singular values of
these two vectors (as columns of a 3 x 2 matrix) are the half axes of the ellipse that a round spot
of the picture becomes on the surface, and their ratio is the anisotropy of the footprint: 1 where a
pressed ball looks round, 2 where it looks twice as long as wide. It is the measure of distortion of
texture mapping (Sander et al., "Texture mapping progressive meshes", 2001) and of filtering there.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from optisense.design.lenses.film import PictureWindow
from optisense.errors import ObjectiveError
from optisense.objectives import _figures
from optisense.objectives._pixel_edges import pixel_edges
from optisense.objectives.registry import objective

if TYPE_CHECKING:
    from optisense.objectives.evaluation import Evaluation
    from optisense.optics import ChiefRays

MOST_ANISOTROPY = 1e3
"""Largest anisotropy of a footprint. A chief ray that only grazes the surface has an infinitely
long footprint; single-precision points resolve ratios up to about this one."""

LEAST_FOOTPRINTS = 100
"""Number of footprints that must lie on the surface: a mean over fewer says little."""

HIGH_SHARE = 95.0
"""Percentile of the anisotropy reported beside its mean: one footprint in twenty is longer."""


@objective(
    "distortion",
    title="Distortion",
    draw=_figures.draw_distortion,
    beside=("area_variation",),
    range=(1.0, MOST_ANISOTROPY),
    lower_is_better=True,
    rays_only=True,
    usual=(1.24, 1.01),  # GelSight360, GelBelt
    numbers=(
        "area_variation",
        "of_one_pixel_in_20",
        "mean_length",
        "mean_width",
        "footprints",
        "pixels_that_see_the_surface",
    ),
)
def distortion(evaluation: Evaluation) -> tuple[float, dict[str, Any], dict[str, Any]]:
    """The ratio of length to width of a pixel's footprint on the sensing surface.

    The value is the geometric mean over all footprints, 1 at best. The part `area_variation` is the
    standard deviation of their areas over the mean.
    """
    rays = evaluation.checked_rays
    long, wide = seen_footprints(rays)
    known = np.isfinite(long)
    ratio = long / np.maximum(wide, long / MOST_ANISOTROPY)
    anisotropy = ratio[known].astype(np.float64)
    area = (long[known] * wide[known]).astype(np.float64)
    parts = {
        "area_variation": float(area.std() / area.mean()),
        "of_one_pixel_in_20": float(np.percentile(anisotropy, HIGH_SHARE)),
        "mean_length": float(long[known].mean(dtype=np.float64)),
        "mean_width": float(wide[known].mean(dtype=np.float64)),
        "footprints": int(np.count_nonzero(known)),
        "pixels_that_see_the_surface": float(rays.hit.mean()),
    }
    value = float(np.exp(np.log(anisotropy).mean()))
    return min(max(value, 1.0), MOST_ANISOTROPY), parts, {"anisotropy": ratio}


def seen_footprints(rays: ChiefRays) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return length and width (h-1, w-1), mm, of the footprints of chief rays; see `footprints`.

    Raises:
        ObjectiveError: fewer than `LEAST_FOOTPRINTS` lie on the sensing surface.
    """
    long, wide = footprints(rays.points, rays.hit, rays.reflections)
    count = np.count_nonzero(np.isfinite(long))
    if count < LEAST_FOOTPRINTS:
        raise ObjectiveError(
            f"{count} of the {LEAST_FOOTPRINTS} footprints of pixels that it needs lie on the "
            "sensing surface",
            hint="Use a higher ray_resolution, or check the camera's position and direction",
        )
    return long, wide


def footprints(
    points: NDArray[np.float32],
    hit: NDArray[np.bool_],
    reflections: NDArray[np.uint32] | None = None,
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return length and width (h-1, w-1), mm, of the footprint between four neighbouring chief
    rays.

    They are the singular values of the mean edges along the row and along the column; NaN where one
    of the four rays misses the surface or an edge crosses a fold.

    Args:
        points: (h, w, 3) end points of the chief rays, mm.
        hit: (h, w) mask of the rays that meet the surface.
        reflections: see `pixel_edges`.
    """
    right, down, leaps_right, leaps_down = pixel_edges(points, hit, reflections)
    whole = hit[:-1, :-1] & hit[:-1, 1:] & hit[1:, :-1] & hit[1:, 1:]
    whole &= ~(leaps_right[:-1] | leaps_right[1:] | leaps_down[:, :-1] | leaps_down[:, 1:])

    half = np.float32(0.5)
    across = [half * (c[:-1] + c[1:]) for c in right]
    along = [half * (c[:, :-1] + c[:, 1:]) for c in down]
    a = _product(across, across)
    b = _product(across, along)
    c = _product(along, along)
    # Eigenvalues of the 2 x 2 matrix [[a, b], [b, c]], whose roots are the singular values.
    middle = 0.5 * (a + c)
    apart = np.hypot(0.5 * (a - c), b)
    long = np.sqrt(middle + apart)
    area = np.sqrt(np.maximum(a * c - b * b, 0.0))
    wide = np.divide(area, long, out=np.zeros_like(area), where=long > 0.0)
    whole &= long > 0.0
    missing = np.float32(np.nan)
    return np.where(whole, long, missing), np.where(whole, wide, missing)


def _product(u: list[NDArray[np.float32]], v: list[NDArray[np.float32]]) -> NDArray[np.float32]:
    """Return the dot products (h, w) of vectors given as x, y and z."""
    product: NDArray[np.float32] = u[0] * v[0] + u[1] * v[1] + u[2] * v[2]
    return product


LEAST_CONTRAST = 0.1
"""Smallest contrast, relative to that of coarse lines, at which fine lines are resolved: the usual
10 per cent of a lens's modulation transfer function."""

LINE_OF_BLUR = math.pi / math.sqrt(2.0 * math.log(1.0 / LEAST_CONTRAST))
"""Width of the finest line, in standard deviations of a Gaussian blur: lines of width w keep
exp(-(pi s / w)^2 / 2) of their contrast (the Gaussian's Fourier transform at the period 2 w)."""


@objective(
    "sharpness",
    title="Sharpness",
    draw=_figures.draw_sharpness,
    beside=("pixel", "blur"),
    range=(0.0, math.inf),
    unit="mm",
    lower_is_better=True,
    rays_only=True,
    usual=(0.27, 0.059),  # GelSight360, ideal GelSight Mini
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
