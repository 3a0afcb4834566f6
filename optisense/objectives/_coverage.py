"""Coverage: the share of the sensing surface that the camera sees."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from optisense.objectives import _figures
from optisense.objectives.registry import objective

if TYPE_CHECKING:
    from optisense.objectives.evaluation import Evaluation


USUAL = (0.46, 0.83)
"""Values of the poorest and the best built-in sensor: GelBelt, GelSight360."""


@objective(
    "coverage",
    title="Coverage",
    draw=_figures.draw_coverage,
    beside=("by_area",),
    range=(0.0, 1.0),
    rays_only=True,
    usual=USUAL,
    numbers=("by_area", "area", "triangles_seen", "triangles", "pixels_that_see_the_surface"),
)
def coverage(evaluation: Evaluation) -> tuple[float, dict[str, Any], dict[str, Any]]:
    """The share of the sensing surface that the camera sees.

    The value is the share of the surface's triangles on which a chief ray arrives, as in AOAP; the
    part `by_area` weights each triangle by its area.
    """
    rays = evaluation.checked_rays
    seen = triangles_seen(evaluation)
    areas = evaluation.model.sensing.face_areas
    parts = {
        "by_area": float(areas[seen].sum() / areas.sum()),
        "area": float(areas[seen].sum()),
        "triangles_seen": int(seen.sum()),
        "triangles": len(seen),
        "pixels_that_see_the_surface": float(rays.hit.mean()),
    }
    return float(seen.mean()), parts, {"hit": rays.hit}


def triangles_seen(evaluation: Evaluation) -> NDArray[np.bool_]:
    """Return a mask (f,) of the triangles of the sensing surface on which a chief ray arrives."""
    rays, faces = evaluation.checked_rays, evaluation.sensing_faces
    seen: NDArray[np.bool_] = np.bincount(rays.face[rays.hit], minlength=faces)[:faces] > 0
    return seen
