"""Feature edges of a solid: creases and open borders."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from optisense.geometry import TriangleMesh


def feature_edges(mesh: TriangleMesh, crease: float) -> NDArray[np.float64]:
    """Return edges between faces that meet at more than `crease` degrees, and edges of one face
    only.

    Args:
        mesh: any mesh; coincident vertices count as one.
        crease: smallest angle between the two faces' normals, degrees.

    Returns:
        End points (k, 2, 3), mm.
    """
    welded = mesh.welded()
    faces = welded.faces.astype(np.int64)
    ends = np.roll(faces, -1, axis=1)
    count = len(welded.vertices)
    # Edges are encoded as one number each, which sorts several times faster than pairs.
    edges = (np.minimum(faces, ends) * count + np.maximum(faces, ends)).reshape(-1)
    order = np.argsort(edges, kind="stable")
    unique, starts, counts = np.unique(edges[order], return_index=True, return_counts=True)
    first = order[starts] // 3
    second = order[np.minimum(starts + 1, len(order) - 1)] // 3
    normals = welded.face_normals
    cosine = np.einsum("ij,ij->i", normals[first], normals[second])
    is_sharp = (counts != 2) | (cosine < np.cos(np.radians(crease)))
    sharp = unique[is_sharp]
    return welded.vertices[np.column_stack([sharp // count, sharp % count])]
