"""The edges that make a solid readable: creases and open borders."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from optisense.geometry import TriangleMesh


def feature_edges(mesh: TriangleMesh, crease: float) -> NDArray[np.float64]:
    """Edges between faces that meet at more than `crease` degrees, and edges of one face only.

    Args:
        mesh: any mesh; vertices at the same place count as one.
        crease: degrees between the two faces' normals.

    Returns:
        (k, 2, 3) end points, mm.
    """
    welded = mesh.welded()
    faces = welded.faces.astype(np.int64)
    edges = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    face_of_edge = np.repeat(np.arange(len(faces)), 3)
    unique, inverse, counts = np.unique(edges, axis=0, return_inverse=True, return_counts=True)
    order = np.argsort(inverse.reshape(-1), kind="stable")
    starts = np.concatenate([[0], np.cumsum(counts)[:-1]])
    first = face_of_edge[order[starts]]
    second = face_of_edge[order[np.minimum(starts + 1, len(order) - 1)]]
    normals = welded.face_normals
    cosine = np.einsum("ij,ij->i", normals[first], normals[second])
    is_sharp = (counts != 2) | (cosine < np.cos(np.radians(crease)))
    return welded.vertices[unique[is_sharp]]
