"""Merging of vertices that lie close together."""

from __future__ import annotations

import numpy as np

from optisense.geometry.connected import connected_components
from optisense.geometry.mesh import TriangleMesh


def merged_vertices(mesh: TriangleMesh, distance: float) -> TriangleMesh:
    """Return a mesh with vertices merged that are nearer to each other than `distance` (mm), and
    without collapsed faces.

    Unlike `TriangleMesh.welded`, which compares coordinates rounded to a grid and is faster, this
    merges all such vertices. Shading normals are dropped.
    """
    from scipy.spatial import cKDTree  # takes a tenth of a second to load

    pairs = cKDTree(mesh.vertices).query_pairs(distance, output_type="ndarray")
    group = connected_components(len(mesh.vertices), pairs[:, 0], pairs[:, 1])
    _, first = np.unique(group, return_index=True)
    faces = group[mesh.faces]
    whole = (faces != np.roll(faces, 1, axis=1)).all(axis=1)
    return TriangleMesh(mesh.vertices[first], faces[whole]).compacted()
