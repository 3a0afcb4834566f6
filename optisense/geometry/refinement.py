"""Refinement of meshes by bisection of the longest edges."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

MAX_PASSES = 40
"""Number of passes after which refinement ends; each pass halves the area of the triangles that it
cuts."""
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
        corner_normals: (m, 3, 3) shading normals of the corners of each face, not normalised again.
        wanted: function that returns the greatest edge length (k,), mm, at places (k, 3).
        max_faces: number of faces; refinement ends if the next pass could exceed it.

    Returns:
        Vertices, faces and corner normals of the finer mesh. Vertices are only added.
    """
    known = np.empty(0, dtype=np.int64)
    for _ in range(MAX_PASSES):
        ends = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        key, edge = np.unique(ends[:, 0] * MOST_VERTICES + ends[:, 1], return_inverse=True)
        edge = edge.reshape(-1, 3)
        first, second = key // MOST_VERTICES, key % MOST_VERTICES
        middles = (vertices[first] + vertices[second]) / 2.0
        length = np.linalg.norm(vertices[first] - vertices[second], axis=1)
        # Edges of the pass before that are still there were short enough.
        fresh = ~_among(key, known)
        cut = np.zeros(len(key), dtype=bool)
        cut[fresh] = length[fresh] > wanted(middles[fresh])
        known = key
        # All triangles choose the same one of several edges of equal length.
        rank = np.empty(len(key), dtype=np.int64)
        rank[np.argsort(length, kind="stable")] = np.arange(len(key))
        longest = np.argmax(rank[edge], axis=1)
        longest_edge = edge[np.arange(len(edge)), longest]
        while True:
            more = cut[edge].any(axis=1) & ~cut[longest_edge]
            if not more.any():
                break
            cut[longest_edge[more]] = True
        if not cut.any() or len(faces) + 2 * int(cut.sum()) > max_faces:
            break
        added = np.cumsum(cut) - 1 + len(vertices)
        vertices = np.concatenate([vertices, middles[cut]])
        faces, corner_normals = _cut(faces, corner_normals, edge, longest, cut, added)
    return vertices, faces, corner_normals


def _among(keys: IntArray, known: IntArray) -> NDArray[np.bool_]:
    """Return a mask of the keys (n,) that are in ``known`` (k,); both ascend."""
    if not len(known):
        return np.zeros(len(keys), dtype=bool)
    place = np.searchsorted(known, keys).clip(max=len(known) - 1)
    return known[place] == keys


def _cut(
    faces: IntArray,
    normals: FloatArray,
    edge: IntArray,
    longest: IntArray,
    cut: NDArray[np.bool_],
    added: IntArray,
) -> tuple[IntArray, FloatArray]:
    """Return faces with their marked edges cut, the longest first."""
    touched = cut[edge].any(axis=1)
    order = (longest[touched, None] + np.arange(3)) % 3  # the longest edge leads from corner 0 to 1
    rows = np.arange(int(touched.sum()))[:, None]
    a, b, c = faces[touched][rows, order].T
    na, nb, nc = np.moveaxis(normals[touched][rows, order], 1, 0)
    ab, bc, ca = edge[touched][rows, order].T
    m, nm = added[ab], (na + nb) / 2.0
    kept = [(faces[~touched], normals[~touched])]
    for x, y, other, nx, ny in ((b, c, bc, nb, nc), (c, a, ca, nc, na)):
        twice = cut[other]
        kept.append(_faces(~twice, (m, nm), (x, nx), (y, ny)))
        middle = added[other], (nx + ny) / 2.0
        kept.append(_faces(twice, (m, nm), (x, nx), middle))
        kept.append(_faces(twice, (m, nm), middle, (y, ny)))
    return np.concatenate([f for f, _ in kept]), np.concatenate([n for _, n in kept])


def _faces(
    chosen: NDArray[np.bool_], *corners: tuple[IntArray, FloatArray]
) -> tuple[IntArray, FloatArray]:
    """Return the ``chosen`` faces and corner normals from three corners."""
    return (
        np.stack([vertex[chosen] for vertex, _ in corners], axis=1),
        np.stack([normal[chosen] for _, normal in corners], axis=1),
    )
