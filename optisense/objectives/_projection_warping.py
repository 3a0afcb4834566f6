"""2to3PW: the evenness of the areas of the sensing surface that pixels see (the OptiSense paper,
"2D-to-3D projection warping objective function").
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from optisense.errors import ObjectiveError
from optisense.objectives import _figures
from optisense.objectives.registry import objective
from optisense.objectives.settings import refuse_outside

if TYPE_CHECKING:
    from optisense.objectives.evaluation import Evaluation

JUMP = 4.0
"""Ratio of the length of an edge to those before and after it in its row or column above which the
edge crosses a fold or a gap. On a smooth surface neighbouring edges differ by at most a factor of
2.4, which occurs where the surface is seen edge-on."""

BAND = 24
"""Number of rows of an image that are processed at once, which the processor's cache holds."""

MOST_EVEN = 1e-6
"""Relative deviation below which differences are rounding of single-precision points."""

LEAST_TRIANGLES = 100
"""Smallest number of triangles between pixels on the surface; fewer deviate by chance."""

MOST_JUMP = 1000.0
"""Largest value of the setting ``jump``; no edge is so many times as long as its neighbours, so
none would be left out."""


class TriangleAreas(NamedTuple):
    """The areas of the two triangles of each pixel quad.

    Attributes:
        areas: (h-1, w-1, 2) areas (mm²), NaN for triangles that are left out.
        missed: number of triangles left out because a corner does not see the surface.
        discontinuous: number of triangles left out because an edge crosses a fold or a gap.
    """

    areas: NDArray[np.float32]
    missed: int
    discontinuous: int


USUAL = (1.2, 60.0)
"""Values of the poorest and the best built-in sensor: GelSight360, GelBelt."""


@objective(
    "2to3pw",
    title="2to3PW",
    draw=_figures.draw_projection_warping,
    beside=("mean_area",),
    range=(0.0, 1.0 / MOST_EVEN),
    rays_only=True,
    usual=USUAL,
    numbers=(
        "mean_area",
        "standard_deviation",
        "triangles",
        "triangles_that_miss_the_surface",
        "triangles_that_leap",
        "pixels_that_see_the_surface",
    ),
)
def projection_warping(
    evaluation: Evaluation, *, jump: float = JUMP
) -> tuple[float, dict[str, Any], dict[str, Any]]:
    """The evenness of the areas of the sensing surface that pixels see: mean over standard
    deviation.

    Each quad of neighbouring pixels forms two triangles on the surface.

    Args:
        jump: ratio of an edge's length to its neighbours' above which the edge crosses a fold or a
            gap, and its triangles are left out.
    """
    refuse_outside("jump", jump, 1.0, MOST_JUMP, open_low=True)
    rays = evaluation.checked_rays
    found = triangle_areas(rays.points, rays.hit, jump)
    areas = found.areas[np.isfinite(found.areas)].astype(np.float64)
    if len(areas) < LEAST_TRIANGLES:
        raise ObjectiveError(
            f"{len(areas)} of the {LEAST_TRIANGLES} triangles between pixels that it needs lie on "
            "the sensing surface",
            hint="Use a higher ray_resolution, or check the camera's position and direction",
        )
    mean = float(areas.mean())
    deviation = float(areas.std())
    parts = {
        "mean_area": mean,
        "standard_deviation": deviation,
        "triangles": len(areas),
        "triangles_that_miss_the_surface": found.missed,
        "triangles_that_leap": found.discontinuous,
        "pixels_that_see_the_surface": float(rays.hit.mean()),
    }
    return mean / max(deviation, MOST_EVEN * mean), parts, {"areas": found.areas}


def triangle_areas(
    points: NDArray[np.float32], hit: NDArray[np.bool_], jump: float = JUMP
) -> TriangleAreas:
    """Return the areas of pixel triangles on the surface, half the cross product of two edges.

    Args:
        points: (h, w, 3) points that the pixels see, mm.
        hit: (h, w) mask of the pixels that see the surface.
        jump: see `JUMP`.
    """
    x, y, z = (np.ascontiguousarray(points[..., axis]) for axis in range(3))
    right = [c[:, 1:] - c[:, :-1] for c in (x, y, z)]
    down = [c[1:] - c[:-1] for c in (x, y, z)]
    upper = _half_cross([c[:-1] for c in right], [c[:, :-1] for c in down])
    lower = _half_cross([c[1:] for c in right], [c[:, 1:] for c in down])
    areas = np.stack([upper, lower], axis=-1)

    corner = hit[:-1, :-1], hit[:-1, 1:], hit[1:, :-1], hit[1:, 1:]
    whole = np.stack(
        [corner[0] & corner[1] & corner[2], corner[1] & corner[2] & corner[3]], axis=-1
    )
    leap_right = discontinuous_edges(right, hit[:, 1:] & hit[:, :-1], 1, jump)
    leap_down = discontinuous_edges(down, hit[1:] & hit[:-1], 0, jump)
    leaps = whole & np.stack(
        [leap_right[:-1] | leap_down[:, :-1], leap_right[1:] | leap_down[:, 1:]], axis=-1
    )
    areas[~whole | leaps] = np.nan
    return TriangleAreas(areas, int((~whole).sum()), int(leaps.sum()))


def _half_cross(a: list[NDArray[np.float32]], b: list[NDArray[np.float32]]) -> NDArray[np.float32]:
    """Return half the length of the cross product, in bands of rows that fit into the cache."""
    half = np.empty_like(a[0])
    for top in range(0, len(half), BAND):
        band = slice(top, top + BAND)
        (ax, ay, az), (bx, by, bz) = ([c[band] for c in edge] for edge in (a, b))
        square = (ay * bz - az * by) ** 2
        square += (az * bx - ax * bz) ** 2
        square += (ax * by - ay * bx) ** 2
        np.sqrt(square, out=half[band])
    half *= np.float32(0.5)
    return half


def discontinuous_edges(
    edges: list[NDArray[np.float32]], there: NDArray[np.bool_], axis: int, jump: float
) -> NDArray[np.bool_]:
    """Return a mask (h, w) of the edges that are much longer than both their neighbours along an
    axis.

    Args:
        edges: x, y and z (h, w) of the edges, mm.
        there: (h, w) mask of the edges with both ends on the surface.
        axis: axis of the pixels along which the edges run.
        jump: see `JUMP`.
    """
    square = edges[0] ** 2 + edges[1] ** 2 + edges[2] ** 2
    square[~there] = np.nan
    lines = np.moveaxis(square, axis, 0)
    longest = np.full_like(lines, np.nan)
    longest[1:] = lines[:-1]
    longest[:-1] = np.fmax(longest[:-1], lines[1:])
    leaps: NDArray[np.bool_] = np.moveaxis(lines > jump**2 * longest, 0, axis)
    return leaps
