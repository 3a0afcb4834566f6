"""Closing the small gaps and overlaps that CAD files leave between solids that touch.

A mesh approximates a curved face by chords, and two parts may be cut into triangles differently, or
drawn a hundredth of a millimetre apart. A ray tracer would find a film of air in every gap. The
functions move one of the two solids onto the other, or a little into it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from optisense.array_types import FloatArray
from optisense.geometry.coincidence import find_coincident
from optisense.geometry.mesh import TriangleMesh
from optisense.geometry.mesh_points import closest_on_triangles
from optisense.geometry.patches import Faces, mean_normal, middle, patches, smoothly_joined

EXACT = 0.001
"""Distance (mm) below which two faces count as touching and are not moved: half of the distance
below which faces touch for a ray tracer. Intended gaps are wider."""

FLAT = 0.05
"""Largest angle (degrees) between neighbouring faces of a flat patch: the rounding of a mesh file
turns a face of 1 mm by 1e-4 degrees, and slivers by more."""

IN_PLANE = 0.001
"""Largest distance (mm) of the vertices of a flat patch from its plane: that of touching faces."""

_PARALLEL = float(np.cos(np.radians(0.1)))
"""Smallest cosine between the normals of flat faces that are moved into one plane (0.1 degrees):
over 10 mm, faces at this angle are 0.02 mm apart, as in drawings that were rounded."""


@dataclass(frozen=True)
class Join:
    """The change that was made at the contact of two solids.

    Attributes:
        mesh: the moved solid.
        gap: the widest gap (positive) or overlap (negative) before, mm; 0 if there was none.
        kind: "none" (nothing to do), "flat" (faces moved into the same plane) or "curved" (faces
            moved a little into the other solid, which must have the higher priority).
        place: (3,) place of the contact, mm.
    """

    mesh: TriangleMesh
    gap: float
    kind: Literal["none", "flat", "curved"]
    place: FloatArray


def touching_area(first: TriangleMesh, second: TriangleMesh, distance: float) -> float:
    """Return the approximate area (mm^2) of `first` within a distance (mm) of `second`."""
    pairs = find_coincident(first, second, distance, facing=True).pairs
    if len(pairs) == 0:
        return 0.0
    areas = (
        float(mesh.face_areas[np.unique(pairs[:, side])].sum())
        for side, mesh in enumerate((first, second))
    )
    return min(areas)


def join(mover: TriangleMesh, fixed: TriangleMesh, distance: float) -> Join:
    """Move faces of one closed solid onto those of another that lie against them.

    Flat faces move along their normals into the other's plane. Curved faces, whose triangles may
    differ from the other's, move to `distance` below its surface, so that cutting `fixed` out of
    the mover leaves them without a gap. Both have outward face normals, and the mover is welded;
    `distance` is the largest one (mm) of faces that are joined.
    """
    wide = find_coincident(mover, fixed, distance, facing=True).pairs
    if len(wide) == 0:
        return Join(mover, 0.0, "none", np.zeros(3))
    near = find_coincident(mover, fixed, EXACT, facing=True).pairs
    place = middle(mover, np.unique(wide[:, 0]))
    if set(map(tuple, wide.tolist())) <= set(map(tuple, near.tolist())):
        return Join(mover, 0.0, "none", place)
    vertices, gap, left = _flat_moves(mover, fixed, wide)
    moved = mover.with_vertices(vertices)
    kind: Literal["none", "flat", "curved"] = "flat" if gap else "none"
    if len(left):
        vertices, width = _curved_moves(moved, fixed, left, distance)
        moved, kind = mover.with_vertices(vertices), "curved"
        gap = max(gap, width, key=abs)
    return Join(moved, gap, kind, place)


def _flat_moves(
    mover: TriangleMesh, fixed: TriangleMesh, pairs: NDArray[np.int64]
) -> tuple[FloatArray, float, NDArray[np.int64]]:
    """Move flat patches into the planes that they lie against; return the vertices, the widest gap
    closed (mm), and the pairs of faces that are not flat.
    """
    vertices, widest = mover.vertices.copy(), 0.0
    done = np.zeros(len(pairs), dtype=bool)
    touched = np.unique(pairs[:, 0])
    for patch in patches(mover, smoothly_joined(mover, touched, FLAT)):
        of_patch = np.isin(pairs[:, 0], patch)
        if not of_patch.any():
            continue
        step = _step_to_plane(mover, patch, fixed, np.unique(pairs[of_patch, 1]))
        if step is None:
            continue
        done |= of_patch
        if abs(step) > EXACT:
            normal = mean_normal(mover, patch)
            vertices[np.unique(mover.faces[patch])] += step * normal / np.linalg.norm(normal)
            widest = max(widest, step, key=abs)
    return vertices, widest, pairs[~done]


def _step_to_plane(
    mover: TriangleMesh, patch: Faces, fixed: TriangleMesh, against: Faces
) -> float | None:
    """Return the distance (mm) along the patch's normal to the plane of the other faces; None if
    they have no common plane.
    """
    normal = mean_normal(mover, patch)
    normal = normal / np.linalg.norm(normal)
    own = mover.vertices[np.unique(mover.faces[patch])] @ normal
    other = fixed.vertices[np.unique(fixed.faces[against])] @ normal
    parallel = (-fixed.face_normals[against] @ normal).min() > _PARALLEL
    if not parallel or max(np.ptp(own), np.ptp(other)) > 2.0 * IN_PLANE:
        return None
    return float(other.mean() - own.mean())


def _curved_moves(
    mover: TriangleMesh, fixed: TriangleMesh, pairs: NDArray[np.int64], distance: float
) -> tuple[FloatArray, float]:
    """Move vertices near the other surface to `distance` below it; return them and the widest gap,
    mm.
    """
    vertex = mover.faces[pairs[:, 0]].astype(np.int64)
    size = len(fixed.faces)
    keys = np.unique(vertex.ravel() * size + np.repeat(pairs[:, 1], 3))
    task = np.column_stack([keys // size, keys % size])
    points = mover.vertices[task[:, 0]]
    nearest = closest_on_triangles(points, fixed.triangles[task[:, 1]])
    apart = np.linalg.norm(points - nearest, axis=1)
    order = np.lexsort((apart, task[:, 0]))
    chosen, first = np.unique(task[order, 0], return_index=True)
    best = order[first]
    least = np.full(len(mover.vertices), np.inf)
    least[chosen] = apart[best]
    # At an edge or a corner of the other mesh, several faces are equally near.
    equal = apart <= least[task[:, 0]] + 1e-9
    normals = np.zeros_like(mover.vertices)
    np.add.at(normals, task[equal, 0], fixed.face_normals[task[equal, 1]])
    normals = normals[chosen] / np.linalg.norm(normals[chosen], axis=1, keepdims=True)
    reached = apart[best] <= distance
    vertices = mover.vertices.copy()
    vertices[chosen[reached]] = (nearest[best] - distance * normals)[reached]
    height = np.einsum("ij,ij->i", points[best] - nearest[best], normals)[reached]
    return vertices, float(height[np.abs(height).argmax()]) if len(height) else 0.0
