"""Sheets as the plates that they are made of: the face of a design, and material behind it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from optisense.array_types import FloatArray
from optisense.geometry import TriangleMesh
from optisense.geometry.connected import connected_components
from optisense.geometry.solids import as_manifold, of_manifold

LONGEST_MITRE = 3.0
"""Largest distance of a corner of the far face from the near one, in thicknesses; the mitre of two
faces at 40 degrees to one another is 2.9 times as long."""

SAME_NORMAL = 1e-9
"""Squared ratio to the largest singular value below which normals count as dependent: two faces at
less than 0.002 degrees to one another are one plane."""


def thickened(mesh: TriangleMesh, thickness: float) -> TriangleMesh | None:
    """Return the plate behind a sheet, or None if the plate is not closed.

    The sheet, a welded open mesh, stays the plate's near face, to which its normals point. The far
    face is parallel to it, mitred at edges. Pieces that meet in an edge of more than two faces are
    made one by one and joined.
    """
    pieces = [mesh.with_faces(mesh.faces[piece]).compacted() for piece in _pieces(mesh)]
    plates = [body_between(each, each.vertices + _offsets(each, thickness)) for each in pieces]
    if len(plates) == 1:
        return plates[0] if plates[0].is_closed and plates[0].volume > 0.0 else None
    solids = [as_manifold(plate) for plate in plates]
    if any(solid.is_empty() for solid in solids):
        return None
    whole = solids[0]
    for solid in solids[1:]:
        whole += solid
    return of_manifold(whole)


def _pieces(mesh: TriangleMesh) -> list[NDArray[np.int64]]:
    """Return the faces of each piece; edges shared by just two faces of one winding join them."""
    ends, inverse, counts = _edges(mesh)
    owner = np.repeat(np.arange(len(mesh.faces)), 3)
    order = np.argsort(inverse, kind="stable")
    starts = np.concatenate([[0], np.cumsum(counts)[:-1]])[counts == 2]
    one, other = order[starts], order[starts + 1]
    alike = ends[one, 0] == ends[other, 1]  # each runs along the edge in the opposite direction
    labels = connected_components(len(mesh.faces), owner[one[alike]], owner[other[alike]])
    return [np.flatnonzero(labels == label) for label in range(labels.max() + 1)]


def _edges(mesh: TriangleMesh) -> tuple[NDArray[np.int32], NDArray[np.int64], NDArray[np.int64]]:
    """Return the sides of all faces, (3 m, 2) vertices, the number (3 m,) of the edge that each is,
    and the number (k,) of sides of each edge.
    """
    sides = mesh.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    _, edge, counts = np.unique(
        np.sort(sides, axis=1), axis=0, return_inverse=True, return_counts=True
    )
    return sides, np.asarray(edge).reshape(-1), counts


def body_between(mesh: TriangleMesh, far: FloatArray) -> TriangleMesh:
    """Return the closed body between a welded sheet and a copy of it, with vertices (n, 3), mm,
    behind its faces.
    """
    count = len(mesh.vertices)
    ends, inverse, counts = _edges(mesh)
    a, b = ends[counts[inverse] == 1].T
    walls = np.concatenate([np.stack([b, a, a + count], 1), np.stack([b, a + count, b + count], 1)])
    faces = np.concatenate([mesh.faces, mesh.faces[:, ::-1] + count, walls])
    return TriangleMesh(np.concatenate([mesh.vertices, far]), faces)


def _offsets(mesh: TriangleMesh, thickness: float) -> FloatArray:
    """Return the displacement from each vertex to the far face, (n, 3) mm, which is `thickness`
    behind the plane of each of its faces, in the least-squares sense.

    It is the shortest solution of the normal equations: where the faces are in one plane, it is
    along their normal.
    """
    normals = np.repeat(mesh.face_normals, 3, axis=0)
    corners = mesh.faces.reshape(-1)
    squares = np.zeros((len(mesh.vertices), 3, 3))
    sums = np.zeros((len(mesh.vertices), 3))
    np.add.at(squares, corners, normals[:, :, None] * normals[:, None, :])
    np.add.at(sums, corners, normals)
    values, axes = np.linalg.eigh(squares)
    known = values > SAME_NORMAL * values[:, -1:]
    inverse = np.divide(1.0, values, out=np.zeros_like(values), where=known)
    along = np.einsum("nik,ni->nk", axes, -thickness * sums)
    ways = np.einsum("nik,nk->ni", axes, inverse * along)
    lengths = np.maximum(np.linalg.norm(ways, axis=1), 1e-12)
    return ways * np.minimum(1.0, LONGEST_MITRE * thickness / lengths)[:, None]
