"""The outer faces of a gel, which its coating lies on."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from .mesh_file import Mesh

FACING = 30.0
"""Degrees between a face and the outward direction up to which the choice of faces begins with it:
the top of a dome faces outward, and its flanks follow by tangency."""

TANGENT = 30.0
"""Degrees between neighbouring faces up to which one continues the other: the edge of a gel's top
is sharper, and the faces of a coarse dome are not."""

WELDED = 1e-5
"""mm: corners nearer than this are one; files of meshes often have each corner once a face."""


def outer_faces(mesh: Mesh, outward: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return the faces that face outward, with those that continue them.

    Args:
        mesh: a solid, its faces counter-clockwise from outside.
        outward: (3,) the direction away from the rest of the sensor.

    Returns:
        (k,) indices of faces; empty where none faces outward.
    """
    normals = face_normals(mesh)
    way = outward / np.linalg.norm(outward)
    facing = normals @ way > math.cos(math.radians(FACING))
    if not facing.any():
        return np.empty(0, dtype=np.int64)
    # Of several terraces, the outermost: the others are steps of a housing's groove, for example.
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
    """The sensing surface that lies on some faces of a gel: turned around, so that it faces in."""
    chosen = _welded(mesh)[mesh.faces[faces]]
    used, numbered = np.unique(chosen, return_inverse=True)
    turned = numbered.reshape(-1, 3)[:, ::-1]
    return Mesh(mesh.vertices[used], np.ascontiguousarray(turned, dtype=np.int32))


def face_normals(mesh: Mesh) -> NDArray[np.float64]:
    """(m, 3) unit normals of the faces; 0 where one has no area."""
    one, two, three = np.moveaxis(mesh.vertices[mesh.faces], 1, 0)
    found = np.cross(two - one, three - one)
    return found / np.maximum(np.linalg.norm(found, axis=1, keepdims=True), 1e-12)


def _welded(mesh: Mesh) -> NDArray[np.int64]:
    """(n,) for each vertex the first one at its place."""
    _, first, inverse = np.unique(
        np.round(mesh.vertices / WELDED).astype(np.int64),
        axis=0,
        return_index=True,
        return_inverse=True,
    )
    return first[inverse.ravel()]


def _neighbours(mesh: Mesh) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Faces that share an edge, in pairs."""
    corners = _welded(mesh)[mesh.faces]
    edges = np.stack([corners, np.roll(corners, -1, axis=1)], axis=-1).reshape(-1, 2)
    edges.sort(axis=1)
    face = np.repeat(np.arange(len(corners)), 3)
    order = np.lexsort((edges[:, 1], edges[:, 0]))
    edges, face = edges[order], face[order]
    same = (edges[1:] == edges[:-1]).all(axis=1)
    return face[:-1][same], face[1:][same]
