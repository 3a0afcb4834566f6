"""Objectives of parts that cages bend: bend radius, draft and cage roughness, which determine how
they can be made.

A sheet breaks or springs back when it is bent too sharply, and a film cannot be laid over a shape
that curves two ways at once. Across an edge of a smooth mesh, the normal turns by the angle between
the two triangles over the distance between their middles. The angle over that distance is the
normal curvature across the edge (Grinspun et al., "Discrete shells", 2003), and its inverse is the
radius.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from optisense.errors import ObjectiveError
from optisense.geometry import TriangleMesh
from optisense.geometry.cage import Resolution
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


@objective(
    "draft",
    title="Draft",
    range=(-90.0, 90.0),
    unit="degrees",
    rays_only=True,
    numbers=(),
)
def draft(evaluation: Evaluation) -> tuple[float, dict[str, Any]]:
    """The smallest draft angle of the sheets that cages bend, in degrees.

    A sheet is pulled off its mould along the mean of its normals, by area. The draft of a place is
    the angle between the surface there and this direction: 90 where the mould is flat, 0 where its
    wall is parallel to the direction, and negative in an undercut, where the sheet cannot be
    removed. Castings usually need 1 to 3 degrees. One hundredth of a sheet's area may be steeper,
    as in `bend_radius`. Closed bodies are left out; a gel is formed by the skin on it.
    """
    design = evaluation.design
    bent = design.deformed_meshes()
    names = dict.fromkeys(part for cage in design.cages.values() for part in cage.parts)
    found = {name: draft_of(bent[name]) for name in names if not bent[name].is_closed}
    if not found:
        raise ObjectiveError(
            "no cage bends a sheet of the design", hint="Make a cage with optisense cage"
        )
    return min(found.values()), {"of_parts": found}


def draft_of(mesh: TriangleMesh) -> float:
    """Return the draft angle (degrees) that all but `SHARE` of a sheet's area exceed."""
    normals, areas = mesh.face_normals, mesh.face_areas
    pull: NDArray[np.float64] = (normals * areas[:, None]).sum(axis=0)
    length = float(np.linalg.norm(pull))
    if length <= 0.0:  # a closed ring: half of it is undercut for any direction of removal
        return -90.0
    angles = np.degrees(np.arcsin(np.clip(normals @ pull / length, -1.0, 1.0)))
    return mostly_above(angles, areas)


@objective(
    "cage_roughness",
    title="Cage roughness",
    range=(0.0, math.inf),
    unit="mm",
    lower_is_better=True,
    rays_only=True,
    numbers=("largest",),
)
def cage_roughness(evaluation: Evaluation) -> tuple[float, dict[str, Any]]:
    """The unevenness of the displacements of the control points of cages, in mm.

    It is the root mean square, over all points with two neighbours along an axis of the lattice, of
    the difference between a point's displacement and the mean displacement of these neighbours. It
    is 0 if the lattice is moved, stretched or sheared as a whole, which bends nothing. The value is
    that of the roughest cage; `largest` is the largest such difference.
    """
    found, largest = {}, 0.0
    for name, cage in evaluation.design.cages.items():
        moved = cage.offsets_at_rest()
        uneven = unevenness(moved, cage.resolution)
        found[name] = float(np.sqrt((uneven**2).mean())) if len(uneven) else 0.0
        largest = max(largest, float(uneven.max(initial=0.0)))
    if not found:
        raise ObjectiveError("the design has no cage", hint="Make a cage with optisense cage")
    return max(found.values()), {"of_cages": found, "largest": largest}


def unevenness(moved: NDArray[np.float64], resolution: Resolution) -> NDArray[np.float64]:
    """Return the distance (k,), mm, between the displacement of each control point and the mean
    displacement of its neighbours.

    Args:
        moved: (nx * ny * nz, 3) displacement of each point, mm.
        resolution: number of points along x, y and z.
    """
    ways = moved.reshape(*resolution, 3)
    found = [
        0.5 * np.linalg.norm(np.diff(ways, 2, axis=axis), axis=-1).ravel()
        for axis in range(3)
        if resolution[axis] > 2
    ]
    return np.concatenate(found) if found else np.zeros(0)
