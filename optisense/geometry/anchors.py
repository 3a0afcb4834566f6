"""Points on a mesh that move with it when it bends."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from optisense.array_types import FloatArray
from optisense.geometry.mesh import TriangleMesh

_SAME = 1e-9
"""Distance (mm) within which a point coincides with a vertex. It is far above the rounding of
coordinates in double precision (1e-14 mm)."""
_NEAREST, _LARGEST = 64, 256
"""Numbers of faces that are tested for each point: those with the nearest centres, and the largest
of all, whose centres may be far from points on them. A vertex of a mesh has six faces on average,
and parts have few large faces."""
_SLACK = 1e-4
"""Barycentric weight by which a point may be outside a face: 1e-4 of its size, for rounding."""


@dataclass(frozen=True)
class Anchors:
    """Points as weighted means of a mesh's vertices.

    Attributes:
        corners: (n, 3) numbers of vertices.
        weights: (n, 3) weights, which add up to 1.
    """

    corners: NDArray[np.int64]
    weights: FloatArray

    def on(self, vertices: FloatArray) -> FloatArray:
        """Return the points (n, 3), mm, for positions (v, 3) of the vertices."""
        moved: FloatArray = np.einsum("nk,nkc->nc", self.weights, vertices[self.corners])
        return moved


def anchored(
    points: FloatArray, mesh: TriangleMesh, tolerance: float
) -> tuple[Anchors, NDArray[np.bool_]]:
    """Find points (n, 3) on a mesh.

    Args:
        points: (n, 3) points, mm.
        mesh: the mesh, mm.
        tolerance: largest distance of a point from the mesh, mm.

    Returns:
        The anchors, and a mask (n,) of the points that were found; the anchors of others are
        arbitrary.
    """
    from scipy.spatial import cKDTree  # takes a tenth of a second to load

    distance, vertex = cKDTree(mesh.vertices).query(points)
    corners = np.repeat(vertex[:, None], 3, axis=1).astype(np.int64)
    weights = np.tile([1.0, 0.0, 0.0], (len(points), 1))
    found = distance <= _SAME
    rest = np.flatnonzero(~found)
    if len(rest) == 0:
        return Anchors(corners, weights), found
    near = min(_NEAREST, len(mesh.faces))
    _, nearest = cKDTree(mesh.triangles.mean(axis=1)).query(points[rest], k=near)
    largest = np.argsort(-mesh.face_areas)[:_LARGEST]
    faces = np.concatenate(
        [nearest.reshape(len(rest), near), np.tile(largest, (len(rest), 1))], axis=1
    )
    a, b, c = (mesh.vertices[mesh.faces[faces, k]] for k in range(3))
    normal = mesh.face_normals[faces]
    off = points[rest, None] - a
    twice = np.maximum(2 * mesh.face_areas[faces], 1e-300)
    second = np.einsum("nfc,nfc->nf", np.cross(off, c - a), normal) / twice
    third = np.einsum("nfc,nfc->nf", np.cross(b - a, off), normal) / twice
    parts = np.stack([1 - second - third, second, third], axis=2)
    height = np.abs(np.einsum("nfc,nfc->nf", off, normal))
    on = (height <= tolerance) & (parts.min(axis=2) >= -_SLACK)
    first = on.argmax(axis=1)
    row = np.arange(len(rest))
    there = on[row, first]
    corners[rest[there]] = mesh.faces[faces[row, first]][there]
    weights[rest[there]] = parts[row, first][there]
    found[rest] = there
    return Anchors(corners, weights), found
