"""What makes a mesh unfit for simulation, and where."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from optisense.errors import MeshError

if TYPE_CHECKING:
    from optisense.geometry.mesh import TriangleMesh


def validate(mesh: TriangleMesh, name: str, closed: bool) -> TriangleMesh:
    """See `TriangleMesh.validate`."""
    if len(mesh.faces) == 0:
        raise MeshError(
            "the mesh has no triangles", where=f"part {name}", hint="check the mesh file"
        )
    bad = np.flatnonzero(~np.isfinite(mesh.vertices).all(axis=1))
    if len(bad):
        raise MeshError(
            f"{len(bad)} vertices are not finite numbers, the first is vertex {bad[0]}",
            where=f"part {name}",
            hint="export the mesh again",
        )
    if mesh.faces.min() < 0 or mesh.faces.max() >= len(mesh.vertices):
        raise MeshError(
            f"a face names a vertex that is not there (the mesh has {len(mesh.vertices)})",
            where=f"part {name}",
            hint="export the mesh again",
        )
    if mesh.area <= 0.0:
        raise MeshError(
            "all triangles have zero area", where=f"part {name}", hint="check the mesh file"
        )
    return _closed_and_outward(mesh, name) if closed else mesh


def _closed_and_outward(mesh: TriangleMesh, name: str) -> TriangleMesh:
    welded = mesh.welded()
    edges = unmatched_edges(welded)
    if len(edges) and len(_leaky_edges(welded)) == 0:
        mesh = welded = with_consistent_winding(welded)
        edges = unmatched_edges(welded)
    if len(edges):
        leaky = _leaky_edges(welded)
        edge = leaky[0] if len(leaky) else edges[0]
        x, y, z = welded.vertices[edge].mean(axis=0)
        raise MeshError(
            f"the solid is not closed: {max(len(leaky), 1)} edges have no second face, "
            f"one of them near ({x:.3f}, {y:.3f}, {z:.3f}) mm",
            where=f"part {name}",
            hint="fill the hole in your modelling program and export again",
        )
    return mesh if mesh.volume >= 0.0 else mesh.flipped()


def unmatched_edges(mesh: TriangleMesh) -> NDArray[np.int64]:
    """Directed edges run through more often than their reverse: (k, 2) rows of the welded mesh."""
    forward, size = _directed_edges(mesh)
    keys, counts = np.unique(forward, return_counts=True)
    backward = (keys % size) * size + keys // size
    place = np.searchsorted(keys, backward).clip(max=len(keys) - 1)
    partner = np.where(keys[place] == backward, counts[place], 0) if len(keys) else counts
    bad = keys[counts > partner]
    return np.column_stack([bad // size, bad % size])


def _leaky_edges(mesh: TriangleMesh) -> NDArray[np.int64]:
    """Edges with an odd number of faces, whichever way they wind: (k, 2)."""
    forward, size = _directed_edges(mesh)
    first, second = forward // size, forward % size
    keys, counts = np.unique(
        np.minimum(first, second) * size + np.maximum(first, second), return_counts=True
    )
    bad = keys[counts % 2 == 1]
    return np.column_stack([bad // size, bad % size])


def _directed_edges(mesh: TriangleMesh) -> tuple[NDArray[np.int64], int]:
    faces = mesh.welded().faces.astype(np.int64)
    size = int(faces.max(initial=0)) + 1
    starts, ends = faces.reshape(-1), np.roll(faces, -1, axis=1).reshape(-1)
    return starts * size + ends, size


def with_consistent_winding(mesh: TriangleMesh) -> TriangleMesh:
    """Turn single faces over until neighbours agree, walking from face to face."""
    from scipy import sparse
    from scipy.sparse import csgraph

    forward, size = _directed_edges(mesh)
    first, second = forward // size, forward % size
    edge = np.minimum(first, second) * size + np.maximum(first, second)
    order = np.argsort(edge, kind="stable")
    follows = edge[order][1:] == edge[order][:-1]
    one, other = order[:-1][follows], order[1:][follows]
    disagrees = {
        (int(a), int(b)): bool(same)
        for a, b, same in zip(one // 3, other // 3, forward[one] == forward[other], strict=True)
    }
    n_faces = len(mesh.faces)
    neighbours = sparse.csr_matrix(
        (np.ones(len(one)), (one // 3, other // 3)), shape=(n_faces, n_faces)
    )
    turned = np.zeros(n_faces, dtype=bool)
    seen = np.zeros(n_faces, dtype=bool)
    for start in range(n_faces):
        if seen[start]:
            continue
        walk, came_from = csgraph.breadth_first_order(neighbours, start, directed=False)
        seen[walk] = True
        for face in walk[1:]:
            pair = (int(came_from[face]), int(face))
            turns = disagrees.get(pair, disagrees.get(pair[::-1], False))
            turned[face] = turned[pair[0]] ^ turns
    faces = np.where(turned[:, None], mesh.faces[:, ::-1], mesh.faces)
    return mesh.with_faces(faces)
