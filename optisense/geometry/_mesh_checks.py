"""Checks for defects that make a mesh unfit for simulation, and their places."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from optisense.errors import MeshError
from optisense.geometry.connected import connected_components

if TYPE_CHECKING:
    from optisense.geometry.mesh import TriangleMesh


LEAST_VOLUME = 1e-12
"""Smallest volume of a solid, as a share of its largest dimension cubed: a 20 mm sheet of glass as
thin as a wavelength of light has 1e-5."""


def validate(mesh: TriangleMesh, name: str, closed: bool) -> TriangleMesh:
    """Check a mesh; see `TriangleMesh.validate`."""
    if len(mesh.faces) == 0:
        raise MeshError(
            "the mesh has no triangles", where=f"part {name}", hint="Check the mesh file"
        )
    bad = np.flatnonzero(~np.isfinite(mesh.vertices).all(axis=1))
    if len(bad):
        raise MeshError(
            f"{len(bad)} vertices are not finite numbers, the first is vertex {bad[0]}",
            where=f"part {name}",
            hint="Export the mesh again",
        )
    if mesh.faces.min() < 0 or mesh.faces.max() >= len(mesh.vertices):
        raise MeshError(
            f"a face names a vertex that does not exist (the mesh has {len(mesh.vertices)})",
            where=f"part {name}",
            hint="Export the mesh again",
        )
    if mesh.area <= 0.0:
        raise MeshError(
            "all triangles have zero area", where=f"part {name}", hint="Check the mesh file"
        )
    return _closed_and_outward(mesh, name) if closed else mesh


def _closed_and_outward(mesh: TriangleMesh, name: str) -> TriangleMesh:
    welded = mesh.welded()
    edges = unmatched_edges(welded)
    leaky = welded.edges[0][welded.edges[1] % 2 == 1]
    if len(edges) and len(leaky) == 0:
        mesh = welded = with_consistent_winding(welded)
        edges = unmatched_edges(welded)
    if len(edges):
        edge = leaky[0] if len(leaky) else edges[0]
        x, y, z = welded.vertices[edge].mean(axis=0)
        raise MeshError(
            f"the solid is not closed: {max(len(leaky), 1)} edges have no second face, "
            f"one of them near ({x:.3f}, {y:.3f}, {z:.3f}) mm",
            where=f"part {name}",
            hint="Fill the hole in your modelling program and export again",
        )
    size = float(np.ptp(mesh.bounds, axis=0).max())
    if abs(mesh.volume) <= LEAST_VOLUME * size**3:
        raise MeshError(
            "the solid encloses no volume: its faces lie upon one another, or in a plane",
            where=f"part {name}",
            hint="Export the solid again, with thickness",
        )
    return mesh if mesh.volume >= 0.0 else mesh.flipped()


def unmatched_edges(mesh: TriangleMesh) -> NDArray[np.int64]:
    """Return directed edges (k, 2) of a welded mesh that occur more often than their reverse."""
    forward, size = _directed_edges(mesh)
    keys, counts = np.unique(forward, return_counts=True)
    backward = (keys % size) * size + keys // size
    place = np.searchsorted(keys, backward).clip(max=len(keys) - 1)
    partner = np.where(keys[place] == backward, counts[place], 0) if len(keys) else counts
    bad = keys[counts > partner]
    return np.column_stack([bad // size, bad % size])


def _directed_edges(mesh: TriangleMesh) -> tuple[NDArray[np.int64], int]:
    faces = mesh.faces.astype(np.int64)
    size = int(faces.max(initial=0)) + 1
    starts, ends = faces.reshape(-1), np.roll(faces, -1, axis=1).reshape(-1)
    return starts * size + ends, size


def with_consistent_winding(mesh: TriangleMesh) -> TriangleMesh:
    """Reverse single faces until neighbours agree with each other, and each shell with its first
    face.

    A shell without a consistent winding (a Moebius strip) is not changed.
    """
    forward, size = _directed_edges(mesh)
    first, second = forward // size, forward % size
    edge = np.minimum(first, second) * size + np.maximum(first, second)
    order = np.argsort(edge, kind="stable")
    follows = edge[order][1:] == edge[order][:-1]
    one, other = order[:-1][follows], order[1:][follows]
    disagree = forward[one] == forward[other]
    if not disagree.any():
        return mesh
    one, other, count = one // 3, other // 3, len(mesh.faces)
    # Each face is a node twice, unchanged and reversed (its number + count), and is linked to the
    # states that its neighbours then need.
    turns = count * disagree
    starts = np.concatenate([one, one + count])
    ends = np.concatenate([other + turns, other + count - turns])
    label = connected_components(2 * count, starts, ends)
    as_is, over = label[:count], label[count:]
    # The two halves of a shell are the same pair of labels; its first face stays as it is.
    _, leader, shell = np.unique(np.minimum(as_is, over), return_index=True, return_inverse=True)
    turned = (as_is != as_is[leader[shell]]) & (as_is != over)
    faces = np.where(turned[:, None], mesh.faces[:, ::-1], mesh.faces)
    return mesh.with_faces(faces)
