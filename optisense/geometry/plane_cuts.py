"""Meshes whose triangles are cut along parallel planes, so that they can bend.

Bisection of edges (`optisense.geometry.refinement`) keeps the angles of triangles. The long, thin
triangles of an extrusion would become thousands of short ones that are as thin.
"""

from __future__ import annotations

from collections import defaultdict
from itertools import pairwise

import numpy as np

from optisense.array_types import FloatArray
from optisense.errors import MeshError
from optisense.geometry.mesh import IntArray, TriangleMesh

SNAP = 0.1
"""Distance of a vertex from a plane, as a share of the distance of the planes, up to which the cut
goes through the vertex: no triangle becomes much thinner than that."""


def cut_along_planes(mesh: TriangleMesh, spacing: float, max_faces: int) -> TriangleMesh:
    """Return a mesh of the same shape whose triangles are cut along planes normal to x, y and z.

    The cut mesh is welded and has no shading normals. Faces beside each other share the vertices of
    a cut, so that a closed mesh stays closed. `spacing` is the largest distance of neighbouring
    planes, mm.

    Raises:
        MeshError: the cut mesh would have more than `max_faces`.
    """
    whole = mesh.welded()
    vertices, faces = whole.vertices, whole.faces
    for axis in range(3):
        low, high = mesh.bounds[:, axis]
        count = max(1, int(min(np.ceil((high - low) / spacing), max_faces)))
        cuts = _Cuts(vertices, axis, np.linspace(low, high, count + 1), max_faces)
        vertices, faces = cuts.cut(faces)
    return TriangleMesh(vertices, faces)


class _Cuts:
    """Cuts of a mesh along the planes of one axis."""

    def __init__(self, vertices: FloatArray, axis: int, levels: FloatArray, max_faces: int) -> None:
        """Number the places of the vertices on the axis: planes have whole numbers."""
        self._vertices = vertices
        self._axis = axis
        self._levels = levels
        self._max_faces = max_faces
        step = float(levels[1] - levels[0]) or 1.0
        exact = (vertices[:, axis] - levels[0]) / step
        nearest = np.round(exact)
        self._places = np.where(np.abs(exact - nearest) <= SNAP, nearest, exact)
        self._new: list[FloatArray] = []
        self._of_edge: dict[tuple[int, int, int], int] = {}

    def cut(self, faces: IntArray) -> tuple[FloatArray, IntArray]:
        """Return vertices and faces of the cut mesh."""
        places = self._places[faces]
        slabs = np.ceil(places.max(axis=1)) - np.floor(places.min(axis=1))
        if slabs.sum() > self._max_faces:
            raise self._too_many()
        crossed = slabs > 1
        pieces = [piece for face in faces[crossed].tolist() for piece in self._pieces(face)]
        if len(pieces) + np.count_nonzero(~crossed) > self._max_faces:
            raise self._too_many()
        made = np.array(pieces, dtype=np.int32).reshape(-1, 3)
        vertices = np.concatenate([self._vertices, np.reshape(self._new, (-1, 3))])
        return vertices, np.concatenate([faces[~crossed], made])

    def _too_many(self) -> MeshError:
        return MeshError(
            f"the cut mesh would have more than {self._max_faces:,} triangles",
            hint="Choose a larger distance of the planes",
        )

    def _pieces(self, face: list[int]) -> list[tuple[int, int, int]]:
        """Return the triangles of a face: those of its polygon between any two planes."""
        outline: list[tuple[float, int]] = []
        for start, end in zip(face, face[1:] + face[:1], strict=True):
            outline.append((self._places[start], start))
            outline += self._crossings(start, end)
        slabs: dict[int, list[int]] = defaultdict(list)
        for place, vertex in outline:
            above = int(np.floor(place))
            slabs[above].append(vertex)
            if place == above:  # on the plane between two slabs
                slabs[above - 1].append(vertex)
        found = []
        for first, *others in slabs.values():
            found += [(first, b, c) for b, c in pairwise(others)]
        return found

    def _crossings(self, start: int, end: int) -> list[tuple[float, int]]:
        """Return places and vertices where an edge crosses planes between its ends, in order."""
        low, high = sorted((start, end), key=lambda vertex: self._places[vertex])
        one, other = self._vertices[low], self._vertices[high]
        planes = range(int(np.floor(self._places[low])) + 1, int(np.ceil(self._places[high])))
        found: list[tuple[float, int]] = []
        for plane in planes:
            key = (low, high, plane)
            if key not in self._of_edge:
                self._of_edge[key] = len(self._vertices) + len(self._new)
                way = self._levels[plane] - one[self._axis]
                share = way / (other[self._axis] - one[self._axis])
                self._new.append(one + share * (other - one))
            found.append((float(plane), self._of_edge[key]))
        return found if low == start else found[::-1]
