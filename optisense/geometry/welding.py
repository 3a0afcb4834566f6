"""Merging of vertices that lie close together."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from optisense.geometry.mesh import TriangleMesh


def merged_vertices(mesh: TriangleMesh, distance: float) -> TriangleMesh:
    """Merge vertices that are nearer to each other than `distance` (mm), and drop collapsed faces.

    Unlike `TriangleMesh.welded`, which compares coordinates rounded to a grid and is faster, this
    merges all such vertices. Shading normals are dropped.
    """
    pairs = cKDTree(mesh.vertices).query_pairs(distance, output_type="ndarray")
    count = len(mesh.vertices)
    graph = coo_matrix((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(count, count))
    _, group = connected_components(graph, directed=False)
    _, first = np.unique(group, return_index=True)
    faces = group[mesh.faces]
    whole = (faces != np.roll(faces, 1, axis=1)).all(axis=1)
    return TriangleMesh(mesh.vertices[first], faces[whole]).compacted()
