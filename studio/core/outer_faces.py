"""Outer faces of a gel, on which its coating lies."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from .mesh_file import Mesh
from .outlines import face_normals

FACING = 30.0
"""Largest angle in degrees between a face and the outward direction for the faces that the
selection starts with: on a dome the top, from which the flanks follow by tangency.
"""

TANGENT = 30.0
"""Largest angle in degrees between neighbouring faces of one smooth surface: smaller than at the
edge of a gel's top, larger than between the faces of a coarse dome.
"""

WELDED = 1e-5
"""Distance in mm below which corners are one: mesh files often repeat a corner for each face."""


def outer_faces(mesh: Mesh, outward: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return the faces that face outward and those that continue them smoothly.

    Args:
        mesh: solid with faces counter-clockwise seen from outside.
        outward: direction away from the rest of the sensor, (3,), of any length but zero.

    Returns:
        Indices of faces, (k,); empty if no face faces outward.
    """
    normals = face_normals(mesh.vertices[mesh.faces])
    way = outward / np.linalg.norm(outward)
    facing = normals @ way > math.cos(math.radians(FACING))
    if not facing.any():
        return np.empty(0, dtype=np.int64)
    # Of several terraces only the outermost is taken: the others may be steps of a housing's
    # groove.
    height = (mesh.vertices[mesh.faces] @ way).max(axis=1)
    seeds = np.flatnonzero(facing & (height >= height[facing].max() - WELDED))
    one, other = _neighbours(mesh)
    smooth = (normals[one] * normals[other]).sum(axis=1) > math.cos(math.radians(TANGENT))
    one, other = one[smooth], other[smooth]
    taken = np.zeros(len(mesh.faces), dtype=bool)
    taken[seeds] = True
    while True:
        before = taken.sum()
        taken[one[taken[other]]] = True
        taken[other[taken[one]]] = True
        if taken.sum() == before:
            return np.flatnonzero(taken)


def skin_of(mesh: Mesh, faces: NDArray[np.int64]) -> Mesh:
    """Return the sensing surface on some faces of a gel, reversed so that they face into it."""
    chosen = _welded(mesh)[mesh.faces[faces]]
    used, numbered = np.unique(chosen, return_inverse=True)
    turned = numbered.reshape(-1, 3)[:, ::-1]
    return Mesh(mesh.vertices[used], np.ascontiguousarray(turned, dtype=np.int32))


def _welded(mesh: Mesh) -> NDArray[np.int64]:
    """Return for each vertex the index of the first vertex at the same place, (n,)."""
    _, first, inverse = np.unique(
        np.round(mesh.vertices / WELDED).astype(np.int64),
        axis=0,
        return_index=True,
        return_inverse=True,
    )
    return first[inverse.ravel()]


def _neighbours(mesh: Mesh) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return pairs of faces that share an edge, as two arrays of indices."""
    corners = _welded(mesh)[mesh.faces]
    edges = np.stack([corners, np.roll(corners, -1, axis=1)], axis=-1).reshape(-1, 2)
    edges.sort(axis=1)
    face = np.repeat(np.arange(len(corners)), 3)
    order = np.lexsort((edges[:, 1], edges[:, 0]))
    edges, face = edges[order], face[order]
    same = (edges[1:] == edges[:-1]).all(axis=1)
    return face[:-1][same], face[1:][same]
