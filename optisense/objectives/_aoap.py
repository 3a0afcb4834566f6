"""AOAP, the mean cosine between the camera's rays and the normals of the sensing surface (the
OptiSense paper, "As-orthographic-as-possible objective function"), and coverage, a part of it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from optisense.errors import ObjectiveError
from optisense.objectives import _figures
from optisense.objectives.registry import objective
from optisense.objectives.settings import refuse_outside

if TYPE_CHECKING:
    from optisense.objectives.evaluation import Evaluation


@objective(
    "coverage",
    title="Coverage",
    draw=_figures.draw_coverage,
    beside=("by_triangles",),
    range=(0.0, 1.0),
    rays_only=True,
    usual=(0.456, 0.749),  # GelBelt, GelSight360
    numbers=(
        "by_triangles",
        "area",
        "triangles_seen",
        "triangles",
        "pixels_that_see_the_surface",
    ),
)
def coverage(evaluation: Evaluation) -> tuple[float, dict[str, Any], dict[str, Any]]:
    """The share of the sensing surface that the camera sees.

    The value is the area that footprints of pixels cover, divided by the area of the surface. It
    depends neither on the mesh's triangles nor on the resolution of the rays, and a place that is
    visible by two mirrors counts once. The part `by_triangles` is the number of triangles on which
    a chief ray arrives, divided by the number of all, as AOAP counts them.
    """
    rays, share = evaluation.checked_rays, evaluation.view.skin
    seen = triangles_seen(evaluation)
    parts = {
        "by_triangles": float(seen.mean()),
        "area": share * evaluation.model.sensing.area,
        "triangles_seen": int(seen.sum()),
        "triangles": len(seen),
        "pixels_that_see_the_surface": float(rays.hit.mean()),
    }
    return share, parts, {"hit": rays.hit}


def triangles_seen(evaluation: Evaluation) -> NDArray[np.bool_]:
    """Return a mask (f,) of the triangles of the sensing surface on which a chief ray arrives."""
    rays, faces = evaluation.checked_rays, evaluation.sensing_faces
    seen: NDArray[np.bool_] = np.bincount(rays.face[rays.hit], minlength=faces)[:faces] > 0
    return seen


COVERAGE_WEIGHT = 0.01
"""Weight k1 of the paper, with which coverage, reported beside the value, hardly counts."""


LEAST_PIXELS = 100
"""Smallest number of pixels that must see the surface; a mean over fewer says little."""


def bounds(*, coverage_weight: float) -> tuple[float, float]:
    """Return the lowest and the highest score; cosine and coverage are each 0 to 1."""
    return 0.0, 1.0 + coverage_weight


@objective(
    "aoap",
    title="AOAP",
    draw=_figures.draw_aoap,
    beside=("coverage_by_area",),
    range=bounds,
    rays_only=True,
    usual=(0.24, 1.0),  # GelSight Svelte, spherical GelSight Mini
    numbers=(
        "coverage",
        "coverage_by_area",
        "mean_cosine",
        "mean_cosine_of_rays_that_arrive",
        "pixels_that_see_the_surface",
        "pixels",
        "triangles_seen",
        "triangles",
    ),
)
def aoap(
    evaluation: Evaluation, *, coverage_weight: float = COVERAGE_WEIGHT
) -> tuple[float, dict[str, Any], dict[str, Any]]:
    """The mean cosine between the camera's rays and the normals of the sensing surface, and
    coverage.

    The value is the mean over all pixels of the cosine between ray and normal (0 for rays that do
    not arrive), plus k1 times the share of the surface's triangles that are seen.

    Args:
        coverage_weight: weight k1, 0 to 1; with 1, coverage counts as much as perpendicular rays.
    """
    refuse_outside("coverage_weight", coverage_weight, 0.0, 1.0)
    rays = evaluation.checked_rays
    hit = rays.hit
    if np.count_nonzero(hit) < LEAST_PIXELS:
        raise ObjectiveError(
            f"{np.count_nonzero(hit)} of the {LEAST_PIXELS} pixels that it needs see the sensing "
            "surface",
            hint="Use a higher ray_resolution, or check the camera's position and direction",
        )
    seen = triangles_seen(evaluation)
    cosine = np.where(hit, np.clip(rays.incidence, 0.0, 1.0), np.float32(0))
    mean_cosine = float(cosine.mean(dtype=np.float64))
    coverage = float(seen.mean())
    parts = {
        "coverage": coverage,
        "coverage_by_area": evaluation.view.skin,
        "mean_cosine": mean_cosine,
        "mean_cosine_of_rays_that_arrive": mean_cosine / float(hit.mean()),
        "pixels_that_see_the_surface": float(hit.mean()),
        "pixels": int(hit.size),
        "triangles_seen": int(seen.sum()),
        "triangles": len(seen),
    }
    return mean_cosine + coverage_weight * coverage, parts, {"cosine": cosine, "hit": hit}
