"""AOAP: the mean cosine between the camera's rays and the normals of the sensing surface (the
OptiSense paper, "As-orthographic-as-possible objective function").
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from optisense.errors import ObjectiveError
from optisense.objectives import _figures
from optisense.objectives._coverage import triangles_seen
from optisense.objectives.registry import objective
from optisense.objectives.settings import refuse_outside

if TYPE_CHECKING:
    from optisense.objectives.evaluation import Evaluation

COVERAGE_WEIGHT = 0.01
"""Weight k1 of the paper, with which coverage, reported beside the value, hardly counts."""


LEAST_PIXELS = 100
"""Smallest number of pixels that must see the surface; a mean over fewer says little."""


def bounds(*, coverage_weight: float) -> tuple[float, float]:
    """Return the lowest and the highest score; cosine and coverage are each 0 to 1."""
    return 0.0, 1.0 + coverage_weight


USUAL = (0.24, 1.0)
"""Values of the poorest and best built-in sensor: GelSight Svelte, spherical GelSight Mini."""


@objective(
    "aoap",
    title="AOAP",
    draw=_figures.draw_aoap,
    beside=("coverage_by_area",),
    range=bounds,
    rays_only=True,
    usual=USUAL,
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
