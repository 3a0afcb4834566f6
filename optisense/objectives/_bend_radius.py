"""Bend radius: the smallest radius to which cages bend the parts of a sensor, which determines how
they can be made.

A sheet breaks or springs back when it is bent too sharply, and a film cannot be laid over a shape
that curves two ways at once. Across an edge of a smooth mesh, the normal turns by the angle between
the two triangles over the distance between their middles. The angle over that distance is the
normal curvature across the edge (Grinspun et al., "Discrete shells", 2003), and its inverse is the
radius.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from optisense.errors import ObjectiveError
from optisense.geometry import TriangleMesh
from optisense.geometry.patches import inner_edges
from optisense.objectives.registry import objective

if TYPE_CHECKING:
    from optisense.objectives.evaluation import Evaluation

MOST_RADIUS = 1e6
"""Radius (mm) of a flat part: a kilometre, far above any radius that can be measured on a part."""

SHARP = 30.0
"""Angle (degrees) between two triangles of the undeformed mesh from which on their common edge is
one of the part's own edges, whose angle is no curvature."""

SHARE = 0.01
"""Share of a part's area that may be bent more sharply than the value; otherwise single thin
triangles at the border of a mesh would determine it."""


@objective(
    "bend_radius",
    title="Bend radius",
    range=(0.0, MOST_RADIUS),
    unit="mm",
    rays_only=True,
    numbers=("sharpest",),
)
def bend_radius(evaluation: Evaluation) -> tuple[float, dict[str, Any]]:
    """The smallest radius of curvature of the parts that cages bend, in mm.

    One hundredth of a part's area may be bent more sharply. The part `of_parts` has the radius of
    each part, and `sharpest` the smallest radius anywhere.
    """
    design = evaluation.design
    names = dict.fromkeys(part for cage in design.cages.values() for part in cage.parts)
    if not names:
        raise ObjectiveError(
            "no cage bends a part of the design", hint="Make a cage with optisense cage"
        )
    bent = design.deformed_meshes()
    radii, sharpest = {}, MOST_RADIUS
    for name in names:
        curvature, area = edge_curvatures(design.meshes[name], bent[name])
        radii[name] = radius_of(curvature, area)
        sharpest = min(sharpest, 1.0 / max(float(curvature.max(initial=0.0)), 1.0 / MOST_RADIUS))
    return min(radii.values()), {"of_parts": radii, "sharpest": sharpest}


def edge_curvatures(
    flat: TriangleMesh, bent: TriangleMesh
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the normal curvatures (e,), 1/mm, across the smooth edges of a bent mesh, and their
    areas (e,), mm².

    Args:
        flat: the undeformed mesh, which determines the sharp edges.
    """
    edges, pairs = inner_edges(flat)
    smooth = _angles(flat, pairs) < np.radians(SHARP)
    edges, pairs = edges[smooth], pairs[smooth]
    ends = bent.vertices[edges]
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    areas = bent.face_areas[pairs]
    # Half the sum of the triangles' heights over the edge, which are 2 A / length.
    way = areas.sum(axis=1) / np.maximum(length, 1e-300)
    turn = 2.0 * np.tan(0.5 * _angles(bent, pairs))
    fine = way > 0.0
    return turn[fine] / way[fine], areas.sum(axis=1)[fine] / 3.0


def radius_of(curvature: NDArray[np.float64], area: NDArray[np.float64]) -> float:
    """Return the radius (mm) that all but `SHARE` of an area exceed.

    Args:
        curvature: (e,) curvatures, 1/mm.
        area: (e,) area of each, mm².
    """
    if not len(curvature):
        return MOST_RADIUS
    return 1.0 / max(-mostly_above(-curvature, area), 1.0 / MOST_RADIUS)


def mostly_above(values: NDArray[np.float64], areas: NDArray[np.float64]) -> float:
    """Return the value that all but `SHARE` of an area exceed; values (n,), areas (n,) mm²."""
    order = np.argsort(values)
    reached = np.cumsum(areas[order])
    return float(values[order[int(np.searchsorted(reached, SHARE * reached[-1]))]])


def _angles(mesh: TriangleMesh, pairs: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return the angles (e,), radians, between the normals of pairs of triangles."""
    one, other = mesh.face_normals[pairs[:, 0]], mesh.face_normals[pairs[:, 1]]
    sine = np.linalg.norm(np.cross(one, other), axis=1)
    cosine = np.einsum("ei,ei->e", one, other)
    return np.asarray(np.arctan2(sine, cosine))
