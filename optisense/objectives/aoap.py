"""AOAP: how nearly the camera looks straight at the sensing surface (the OptiSense paper,
"As-orthographic-as-possible objective function").
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from optisense.errors import ObjectiveError
from optisense.objectives import figures
from optisense.objectives.registry import no_pixels, objective
from optisense.objectives.settings import refuse_outside

if TYPE_CHECKING:
    from optisense.objectives.evaluation import Evaluation

COVERAGE_WEIGHT = 0.01
"""k1 of the paper. Coverage hardly counts at this weight: look at it beside the value."""


@objective("aoap", title="AOAP", draw=figures.draw_aoap, beside=("coverage",), reads=no_pixels)
def aoap(
    evaluation: Evaluation, *, coverage_weight: float = COVERAGE_WEIGHT
) -> tuple[float, dict[str, Any], dict[str, Any]]:
    """How nearly the camera's rays stand upright on the sensing surface, and how much they cover.

    Mean over all pixels of the cosine between ray and normal, rays that do not arrive counting 0,
    plus k1 times the part of the surface's triangles that are seen.

    Args:
        evaluation: the sensor.
        coverage_weight: k1.
    """
    refuse_outside("coverage_weight", coverage_weight, 0.0)
    rays = evaluation.chief_rays
    hit = rays.hit
    if not hit.any():
        raise ObjectiveError(
            "the camera sees nothing of the sensing surface",
            hint="Check the camera's position, direction and field of view",
        )
    faces = evaluation.sensing_faces
    seen = np.bincount(rays.face[hit], minlength=faces)[:faces] > 0
    cosine = np.where(hit, rays.incidence, np.float32(0))
    mean_cosine = float(cosine.mean(dtype=np.float64))
    coverage = float(seen.mean())
    areas = evaluation.model.sensing.face_areas
    parts = {
        "coverage": coverage,
        "coverage_by_area": float(areas[seen].sum() / areas.sum()),
        "mean_cosine": mean_cosine,
        "mean_cosine_of_rays_that_arrive": mean_cosine / float(hit.mean()),
        "pixels_that_see_the_surface": float(hit.mean()),
        "pixels": int(hit.size),
        "triangles_seen": int(seen.sum()),
        "triangles": faces,
    }
    return mean_cosine + coverage_weight * coverage, parts, {"cosine": cosine, "hit": hit}
