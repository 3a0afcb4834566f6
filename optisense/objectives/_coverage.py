"""Coverage: the share of the sensing surface that the camera sees."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from optisense.objectives import _figures
from optisense.objectives.registry import objective

if TYPE_CHECKING:
    from optisense.objectives.evaluation import Evaluation


USUAL = (0.456, 0.749)
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
