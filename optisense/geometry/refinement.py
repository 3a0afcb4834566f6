"""Refinement of meshes by bisection of the longest edges."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from optisense.array_types import FloatArray, IntArray

MAX_PASSES = 40
"""Number of passes after which refinement ends. Each pass halves the area of the triangles that it
cuts, so that forty make their sides a million times shorter."""
MOST_VERTICES = 2**31
"""Number above all numbers of vertices: two of them in one integer of 64 bits name an edge."""


def refine(
    vertices: FloatArray,
    faces: IntArray,
    corner_normals: FloatArray,
    wanted: Callable[[FloatArray], FloatArray],
    max_faces: int,
) -> tuple[FloatArray, IntArray, FloatArray]:
    """Bisect triangles until no edge is longer than wanted at its middle.

    A triangle is cut through its longest edge first, and so is its neighbour across that edge
    (Rivara 1984): no vertex ends up inside an edge of another triangle, and angles do not become
    much smaller than they were.

    Args:
        vertices: (n, 3) vertices, mm; all faces that meet at a place share one vertex.
        faces: (m, 3) rows of ``vertices``.
        corner_normals: (m, 3, k) shading normals of the corners of each face, not normalised again;
            further columns are interpolated as well.
        wanted: function that returns the greatest edge length (k,), mm, at places (k, 3).
        max_faces: number of faces; refinement ends if the next pass could exceed it.

    Returns:
        Vertices, faces and corner normals of the finer mesh. Vertices are only added.
    """
    edges = _Edges.of(vertices, faces)
    for _ in range(MAX_PASSES):
        cut = edges.marked(vertices, wanted)
        longest, longest_edge = edges.longest()
        while True:
            more = cut[edges.of_faces].any(axis=1) & ~cut[longest_edge]
            if not more.any():
                break
            cut[longest_edge[more]] = True
        if not cut.any() or len(faces) + 2 * int(cut.sum()) > max_faces:
            break
        ends = edges.ends[cut]
        vertices = np.concatenate([vertices, (vertices[ends[:, 0]] + vertices[ends[:, 1]]) / 2.0])
        faces, corner_normals = edges.cut(vertices, faces, corner_normals, longest, cut)
    return vertices, faces, corner_normals


@dataclass
class _Edges:
    """The edges of a mesh. Those that were cut stay in the table, without a face.

    Attributes:
        ends: (n, 2) vertices at the ends of each edge.
        length: (n,) lengths, mm.
        checked: (n,) mask of the edges that are known to be as short as wanted, or were cut.
        of_faces: (m, 3) edges of each face, from each of its corners to the next.
    """

    ends: IntArray
    length: FloatArray
    checked: NDArray[np.bool_]
    of_faces: IntArray

    @classmethod
    def of(cls, vertices: FloatArray, faces: IntArray) -> _Edges:
        """Return the edges of a mesh of vertices (n, 3) and faces (m, 3)."""
        ends = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        key, edge = np.unique(ends[:, 0] * MOST_VERTICES + ends[:, 1], return_inverse=True)
        ends = np.stack([key // MOST_VERTICES, key % MOST_VERTICES], axis=1)
        length = _lengths(vertices, ends)
        return cls(ends, length, np.zeros(len(key), dtype=bool), edge.reshape(-1, 3))

    def marked(
        self, vertices: FloatArray, wanted: Callable[[FloatArray], FloatArray]
    ) -> NDArray[np.bool_]:
        """Return a mask (n,) of the edges that are longer than wanted."""
        fresh = np.flatnonzero(~self.checked)
        middles = (vertices[self.ends[fresh, 0]] + vertices[self.ends[fresh, 1]]) / 2.0
        cut = np.zeros(len(self.ends), dtype=bool)
        cut[fresh] = self.length[fresh] > wanted(middles)
        self.checked[fresh] = True
        return cut

    def longest(self) -> tuple[IntArray, IntArray]:
        """Return the corner (m,) at which the longest edge of each face begins, and this edge.

        All triangles choose the same one of several edges of equal length, the last one.
        """
        length = self.length[self.of_faces]
        last = np.where(length == length.max(axis=1, keepdims=True), self.of_faces, -1)
        corner = np.argmax(last, axis=1)
        return corner, self.of_faces[np.arange(len(corner)), corner]

    def cut(
        self,
        vertices: FloatArray,
        faces: IntArray,
        normals: FloatArray,
        longest: IntArray,
        cut: NDArray[np.bool_],
    ) -> tuple[IntArray, FloatArray]:
        """Cut the edges of a mask (n,), the longest of each face first; return faces and normals.

        The last vertices are the middles of these edges, `normals` (m, 3, 3) those of the corners
        of `faces` (m, 3), and `longest` (m,) the corner at which the longest edge of each begins.
        """
        number = np.cumsum(cut) - 1
        middle = number + len(vertices) - int(cut.sum())
        half = 2 * number + len(self.ends)  # the half at the first end of the edge, then the other
        touched = cut[self.of_faces].any(axis=1)
        order = (longest[touched, None] + np.arange(3)) % 3  # the longest edge leads from 0 to 1
        rows = np.arange(int(touched.sum()))[:, None]
        a, b, c = faces[touched][rows, order].T
        na, nb, nc = np.moveaxis(normals[touched][rows, order], 1, 0)
        ab, bc, ca = self.of_faces[touched][rows, order].T
        m, nm = middle[ab], (na + nb) / 2.0
        new = [np.stack([self.ends[cut], np.broadcast_to(middle[cut, None], (cut.sum(), 2))], 2)]
        count = len(self.ends) + 2 * int(cut.sum())
        across = count + np.arange(len(a))  # the edge from the middle to the opposite corner
        new.append(np.stack([m, c], axis=1)[None])
        count += len(a)

        def part(edge: IntArray, end: IntArray) -> IntArray:
            return np.asarray(half[edge] + (self.ends[edge, 1] == end))

        kept = [(faces[~touched], normals[~touched], self.of_faces[~touched])]
        to_a, to_b = part(ab, a), part(ab, b)
        sides = (
            ((b, nb), (c, nc), (to_b, bc, across)),
            ((c, nc), (a, na), (across, ca, to_a)),
        )
        for (x, nx), (y, ny), (first, other, last) in sides:
            once, twice = ~cut[other], cut[other]
            kept.append(_faces(once, ((m, nm), (x, nx), (y, ny)), (first, other, last)))
            inner = np.zeros_like(x)
            inner[twice] = count + np.arange(int(twice.sum()))
            count += int(twice.sum())
            o, no = middle[other], (nx + ny) / 2.0
            new.append(np.stack([m[twice], o[twice]], axis=1)[None])
            to_x, to_y = part(other, x), part(other, y)
            kept.append(_faces(twice, ((m, nm), (x, nx), (o, no)), (first, to_x, inner)))
            kept.append(_faces(twice, ((m, nm), (o, no), (y, ny)), (inner, to_y, last)))
        ends = np.concatenate([each.reshape(-1, 2) for each in new])
        self.ends = np.concatenate([self.ends, ends])
        self.length = np.concatenate([self.length, _lengths(vertices, ends)])
        self.checked = np.concatenate([self.checked, np.zeros(len(ends), dtype=bool)])
        self.of_faces = np.concatenate([each for _, _, each in kept])
        return np.concatenate([f for f, _, _ in kept]), np.concatenate([n for _, n, _ in kept])


def _lengths(vertices: FloatArray, ends: IntArray) -> FloatArray:
    """Return the lengths (n,), mm, of edges from their ends (n, 2)."""
    return np.asarray(np.linalg.norm(vertices[ends[:, 0]] - vertices[ends[:, 1]], axis=1))


def _faces(
    chosen: NDArray[np.bool_],
    corners: tuple[tuple[IntArray, FloatArray], ...],
    edges: tuple[IntArray, ...],
) -> tuple[IntArray, FloatArray, IntArray]:
    """Return the ``chosen`` faces, their corner normals and their edges."""
    return (
        np.stack([vertex[chosen] for vertex, _ in corners], axis=1),
        np.stack([normal[chosen] for _, normal in corners], axis=1),
        np.stack([edge[chosen] for edge in edges], axis=1),
    )
