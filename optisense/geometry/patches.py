"""Selection of faces of a mesh as in CAD tools: by their normals, and along smooth edges."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from optisense.array_types import FloatArray
from optisense.geometry.connected import connected_components

if TYPE_CHECKING:
    from optisense.geometry.mesh import TriangleMesh

Faces = NDArray[np.int64]

SHARP = 30.0
"""Angle (degrees) between neighbouring faces above which they meet in a sharp edge: facets of a
curved surface differ by some degrees, and the edges of machined parts by 45 degrees and more."""


def faces_towards(mesh: TriangleMesh, direction: ArrayLike, within: float) -> Faces:
    """Return the faces (k,) with normals within an angle (degrees) of a direction (3,)."""
    way = np.asarray(direction, dtype=np.float64)
    cosine = mesh.face_normals @ (way / np.linalg.norm(way))
    return np.flatnonzero((cosine >= np.cos(np.radians(within)) - 1e-12) & (mesh.face_areas > 0))


def angle_to_nearest(mesh: TriangleMesh, direction: ArrayLike) -> float:
    """Return the angle (degrees) between a direction (3,) and the face normal nearest to it."""
    way = np.asarray(direction, dtype=np.float64)
    cosine = (mesh.face_normals @ (way / np.linalg.norm(way)))[mesh.face_areas > 0]
    return float(np.degrees(np.arccos(np.clip(cosine.max(), -1.0, 1.0))))


def smoothly_joined(mesh: TriangleMesh, start: Faces, sharp: float = SHARP) -> Faces:
    """Return the faces `start` of a welded mesh and all that are connected to them without an edge
    between normals at an angle of `sharp` degrees or more.
    """
    one, other = inner_edges(mesh)[1].T
    cosine = np.einsum("ij,ij->i", mesh.face_normals[one], mesh.face_normals[other])
    smooth = cosine >= np.cos(np.radians(sharp)) - 1e-12
    label = connected_components(len(mesh.faces), one[smooth], other[smooth])
    return np.flatnonzero(np.isin(label, label[start]))


def patches(mesh: TriangleMesh, faces: Faces) -> list[Faces]:
    """Divide faces into patches connected by edges, the largest first.

    Patches of equal area are ordered by position, so that their order is reproducible.
    """
    one, other = inner_edges(mesh)[1].T
    chosen = np.zeros(len(mesh.faces), dtype=bool)
    chosen[faces] = True
    both = chosen[one] & chosen[other]
    label = connected_components(len(mesh.faces), one[both], other[both])[faces]
    groups = [faces[label == number] for number in np.unique(label)]

    def order(group: Faces) -> tuple[float, ...]:
        area = round(float(mesh.face_areas[group].sum()), 3)
        return -area, *np.round(middle(mesh, group), 3).tolist()

    return sorted(groups, key=order)


def sides_of_faces(mesh: TriangleMesh) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the vertices (3 m, 2) of the sides of all faces, in an order in which the sides of
    faces that share an edge are successive, and the face (3 m,) of each.
    """
    sides, order = mesh._sorted_sides
    return np.column_stack(np.divmod(sides[order], len(mesh.vertices))), order // 3


def inner_edges(mesh: TriangleMesh) -> tuple[NDArray[np.int64], Faces]:
    """Return the vertices (k, 2) of the edges between two faces, and these faces (k, 2)."""
    sides, order = mesh._sorted_sides
    twin = np.flatnonzero(np.diff(sides[order]) == 0)
    one, other = order[twin], order[twin + 1]
    edges = np.divmod(sides[one], len(mesh.vertices))
    return np.column_stack(edges), np.column_stack([one // 3, other // 3])


def middle(mesh: TriangleMesh, faces: Faces | None = None) -> FloatArray:
    """Return the centre of area (3,), mm, of the given or of all faces."""
    chosen = np.arange(len(mesh.faces)) if faces is None else faces
    areas = mesh.face_areas[chosen]
    centres = mesh.triangles[chosen].mean(axis=1)
    return np.asarray((areas[:, None] * centres).sum(axis=0) / areas.sum())


def mean_normal(mesh: TriangleMesh, faces: Faces | None = None) -> FloatArray:
    """Return the area-weighted mean (3,) of face normals; shorter than 1 on a curved surface."""
    chosen = np.arange(len(mesh.faces)) if faces is None else faces
    return np.asarray(mesh.face_vectors[chosen].sum(axis=0) / 2.0 / mesh.face_areas[chosen].sum())
