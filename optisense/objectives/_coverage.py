"""Coverage: the share of the sensing surface that the camera sees."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from optisense.objectives import _figures
from optisense.objectives.registry import objective

if TYPE_CHECKING:
    from optisense.objectives.evaluation import Evaluation


USUAL = (0.484, 0.789)
"""Values of the poorest and the best built-in sensor: GelBelt, GelSight360."""


@objective(
    "coverage",
    title="Coverage",
    draw=_figures.draw_coverage,
    beside=("by_triangles",),
    range=(0.0, 1.0),
    rays_only=True,
    usual=USUAL,
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

    The value is the area of the triangles on which a chief ray arrives, divided by the area of the
    surface. The part `by_triangles` divides their numbers instead, as AOAP does; it depends on how
    finely each place of the surface is divided into triangles.
    """
    rays = evaluation.checked_rays
    seen = triangles_seen(evaluation)
    parts = {
        "by_triangles": float(seen.mean()),
        "area": float(evaluation.model.sensing.face_areas[seen].sum()),
        "triangles_seen": int(seen.sum()),
        "triangles": len(seen),
        "pixels_that_see_the_surface": float(rays.hit.mean()),
    }
    return share_of_area(evaluation, seen), parts, {"hit": rays.hit}


def triangles_seen(evaluation: Evaluation) -> NDArray[np.bool_]:
    """Return a mask (f,) of the triangles of the sensing surface on which a chief ray arrives."""
    rays, faces = evaluation.checked_rays, evaluation.sensing_faces
    seen: NDArray[np.bool_] = np.bincount(rays.face[rays.hit], minlength=faces)[:faces] > 0
    return seen


def share_of_area(evaluation: Evaluation, seen: NDArray[np.bool_]) -> float:
    """Return the area of some triangles of the sensing surface, given as a mask (f,), divided by
    the area of the surface.
    """
    areas = evaluation.model.sensing.face_areas
    return float(areas[seen].sum() / areas.sum())
