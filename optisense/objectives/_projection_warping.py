"""2to3PW: the evenness of the areas of the sensing surface that pixels see (the OptiSense paper,
"2D-to-3D projection warping objective function").
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from optisense.errors import ObjectiveError
from optisense.objectives import _figures
from optisense.objectives._pixel_edges import JUMP, pixel_edges
from optisense.objectives.registry import objective
from optisense.objectives.settings import refuse_outside

if TYPE_CHECKING:
    from optisense.objectives.evaluation import Evaluation

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


@objective(
    "2to3pw",
    title="2to3PW",
    draw=_figures.draw_projection_warping,
    beside=("mean_area",),
    range=(0.0, 1.0 / MOST_EVEN),
    rays_only=True,
    usual=(1.2, 60.0),  # GelSight360, GelBelt
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
            gap. Its triangles are left out, as are those between rays that different surfaces
            reflect.
    """
    refuse_outside("jump", jump, 1.0, MOST_JUMP, open_low=True)
    rays = evaluation.checked_rays
    found = triangle_areas(rays.points, rays.hit, rays.reflections, jump)
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
    points: NDArray[np.float32],
    hit: NDArray[np.bool_],
    reflections: NDArray[np.uint32] | None = None,
    jump: float = JUMP,
) -> TriangleAreas:
    """Return the areas of pixel triangles on the surface, half the cross product of two edges.

    Args:
        points: (h, w, 3) points that the pixels see, mm.
        hit: (h, w) mask of the pixels that see the surface.
        reflections, jump: see `pixel_edges`.
    """
    right, down, leaps_right, leaps_down = pixel_edges(points, hit, reflections, jump)
    upper = _half_cross([c[:-1] for c in right], [c[:, :-1] for c in down])
    lower = _half_cross([c[1:] for c in right], [c[:, 1:] for c in down])
    areas = np.stack([upper, lower], axis=-1)

    corner = hit[:-1, :-1], hit[:-1, 1:], hit[1:, :-1], hit[1:, 1:]
    whole = np.stack(
        [corner[0] & corner[1] & corner[2], corner[1] & corner[2] & corner[3]], axis=-1
    )
    leaps = whole & np.stack(
        [leaps_right[:-1] | leaps_down[:, :-1], leaps_right[1:] | leaps_down[:, 1:]], axis=-1
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
