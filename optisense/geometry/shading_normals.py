"""Smooth shading normals of a mesh, kept apart across its sharp edges.

Corner normals are averages over the faces around the vertex, weighted by the corner angle
(Thuermer and Wuethrich, "Computing vertex normals from polygonal facets", J. Graphics Tools 3,
1998); vertices are split where their corners disagree.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from optisense.array_types import FloatArray

if TYPE_CHECKING:
    from optisense.geometry.mesh import TriangleMesh

CREASE = 40.0
"""Angle (degrees) between faces above which an edge always stays sharp in shading: most edges of
machined parts are at 45 degrees and more, and facets of curved surfaces at a few degrees. Below it,
creases between flat faces are sharp; see `_creases`."""

SAME_NORMAL = 1e-6
"""Difference between the components of unit normals below which corners of a vertex share it: far
above the rounding of double precision, and an angle of 6e-5 degrees."""

FLAT = 1e-6
"""Largest difference between the components of corner and face normals (unit vectors) at which a
mesh has flat facets: far above the rounding of normals in double precision (1e-15), and an angle of
only 6e-5 degrees."""


def shaded(mesh: TriangleMesh) -> TriangleMesh:
    """Return a mesh with shading normals: its own or, without any, `vertex_normals`."""
    return mesh if mesh.normals is not None else mesh.vertex_normals()


def is_flat(mesh: TriangleMesh) -> bool:
    """Return whether the shading normals of a mesh are those of its faces."""
    assert mesh.normals is not None
    corners = mesh.normals[mesh.faces] - mesh.face_normals[:, None]
    return bool(np.abs(corners).max() < FLAT)


def smooth_corners(
    mesh: TriangleMesh,
) -> tuple[NDArray[np.integer], NDArray[np.int32], FloatArray]:
    """Compute corner normals, and split the vertices whose corners disagree.

    Args:
        mesh: the mesh; its own shading normals only decide where edges are sharp.

    Returns:
        The old number (k,) of each new vertex, faces (m, 3) int32 of the new vertices, and their
        unit normals (k, 3).
    """
    faces, source = mesh._divided
    vertex = faces.reshape(-1)
    count = len(source)
    normal = np.repeat(mesh.face_normals, 3, axis=0)
    weighted = corner_angles(mesh.triangles)[:, None] * normal
    total = np.column_stack([np.bincount(vertex, weighted[:, k], count) for k in range(3)])
    length = np.linalg.norm(total, axis=1, keepdims=True)
    mean: FloatArray = total / np.where(length > 0, length, 1.0)
    # Faces within half the crease angle of their mean are within the crease angle of each other.
    # This is the usual case, and needs no test of pairs.
    lowest = np.full(count, np.inf)
    np.minimum.at(lowest, vertex, np.einsum("ij,ij->i", mean[vertex], normal))
    plain = (lowest >= np.cos(np.radians(CREASE / 2))) & np.isfinite(lowest)

    new = np.full(count, -1, dtype=np.int64)
    kept = np.flatnonzero(plain)
    new[kept] = np.arange(len(kept))
    corner = new[vertex]
    others = np.flatnonzero(corner < 0)
    if not len(others):
        return source[kept], corner.reshape(-1, 3).astype(np.int32), mean[kept]
    split = _averaged(vertex[others], weighted[others], normal[others])
    key = np.column_stack([vertex[others], np.round(split / SAME_NORMAL).astype(np.int64)])
    _, first, inverse = np.unique(key, axis=0, return_index=True, return_inverse=True)
    corner[others] = len(kept) + inverse.reshape(-1)
    return (
        source[np.concatenate([kept, vertex[others][first]])],
        corner.reshape(-1, 3).astype(np.int32),
        np.concatenate([mean[kept], split[first]]),
    )


def _averaged(vertex: NDArray[np.integer], weighted: FloatArray, normal: FloatArray) -> FloatArray:
    """Return each corner's mean normal (c, 3) over its vertex's corners within the crease angle."""
    from scipy import sparse  # takes a tenth of a second to load

    count = len(vertex)
    incidence = sparse.csr_matrix(
        (np.ones(count, np.int8), vertex, np.arange(count + 1)),
        shape=(count, int(vertex.max()) + 1),
    )
    pairs = (incidence @ incidence.T).tocoo()
    agree = np.einsum("ij,ij->i", normal[pairs.row], normal[pairs.col])
    near = (agree >= np.cos(np.radians(CREASE))) | (pairs.row == pairs.col)
    join = sparse.csr_matrix(
        (np.ones(int(near.sum())), (pairs.row[near], pairs.col[near])), shape=(count, count)
    )
    smooth = join @ weighted
    length = np.linalg.norm(smooth, axis=1, keepdims=True)
    return np.asarray(np.where(length > 1e-12, smooth / np.maximum(length, 1e-12), normal))


def corner_angles(triangles: FloatArray) -> FloatArray:
    """Return the angle (3 m,) float64, radians, of each corner of triangles (m, 3, 3)."""
    edges = [triangles[:, (k + 1) % 3] - triangles[:, k] for k in range(3)]
    twice_area = np.linalg.norm(np.cross(edges[0], edges[1]), axis=1)
    angles = np.empty((len(triangles), 3))
    for corner in range(3):  # between the edge that leaves it and the one that arrives
        along = -np.einsum("ij,ij->i", edges[corner], edges[corner - 1])
        angles[:, corner] = np.arctan2(twice_area, along)
    return np.maximum(angles, 1e-9).reshape(-1)
