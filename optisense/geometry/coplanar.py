"""Merging of coplanar triangles, as ray tracing needs no fine tessellation of flat faces."""

from __future__ import annotations

import manifold3d
import numpy as np
from numpy.typing import NDArray

from optisense.geometry.connected import connected_components
from optisense.geometry.mesh import TriangleMesh
from optisense.geometry.patches import inner_edges

SAME_DIRECTION = 1e-10
"""Largest difference from 1 of the cosine between the normals of coplanar faces. It corresponds to
8e-4 degrees, the rounding of a small face's corners in single precision."""
SAME_PLANE = 1e-6
"""Distance (mm) below which two parallel planes are one: about the rounding of coordinates in
single precision."""
STRAIGHT = 1e-6
"""Sine of the angle between the sides of a corner (6e-5 degrees) below which the outline is
straight there, so that the corner is not needed."""

Loop = list[int]


def merge_coplanar(mesh: TriangleMesh) -> TriangleMesh:
    """Triangulate every flat, connected patch of triangles of a mesh again from its outline.

    Patches keep their outlines, except for points along straight lines. Shading normals are
    dropped, so this is for meshes with flat facets. A patch whose outline touches itself is not
    changed.
    """
    mesh = mesh.welded()
    patches = _patches(mesh)
    faces: list[NDArray[np.int64]] = []
    for members in np.split(
        np.argsort(patches, kind="stable"), np.cumsum(np.bincount(patches))[:-1]
    ):
        old = np.asarray(mesh.faces[members], dtype=np.int64)
        new = _triangulated(mesh, old) if len(old) > 2 else None
        faces.append(old if new is None else new)
    merged = TriangleMesh(mesh.vertices, np.concatenate(faces).astype(np.int32))
    return merged.compacted()


def _patches(mesh: TriangleMesh) -> NDArray[np.int64]:
    """Return the number (m,) of the coplanar, connected patch that each face belongs to."""
    faces = np.asarray(mesh.faces, dtype=np.int64)
    normals = mesh.face_normals
    offsets = np.einsum("ij,ij->i", normals, mesh.vertices[faces[:, 0]])
    one, other = inner_edges(mesh)[1].T
    flat = (np.einsum("ij,ij->i", normals[one], normals[other]) > 1 - SAME_DIRECTION) & (
        np.abs(offsets[one] - offsets[other]) < SAME_PLANE
    )
    return connected_components(len(faces), one[flat], other[flat])


def _triangulated(mesh: TriangleMesh, faces: NDArray[np.int64]) -> NDArray[np.int64] | None:
    """Return new faces for a patch, or None if its outline does not consist of simple loops."""
    loops = _outline(faces)
    if loops is None:
        return None
    loops = [_corners(mesh.vertices, loop) for loop in loops]
    if any(len(loop) < 3 for loop in loops):
        return None
    a, b, c = mesh.vertices[faces[0]]
    x = (b - a) / np.linalg.norm(b - a)
    normal = np.cross(b - a, c - a)
    y = np.cross(normal / np.linalg.norm(normal), x)
    flat = [np.stack([mesh.vertices[loop] @ x, mesh.vertices[loop] @ y], axis=1) for loop in loops]
    corners = np.concatenate([np.asarray(loop, dtype=np.int64) for loop in loops])
    triangles = np.asarray(manifold3d.triangulate(flat), dtype=np.int64)
    if len(triangles) == 0 or len(triangles) >= len(faces):
        return None
    return np.asarray(corners[triangles])


def _outline(faces: NDArray[np.int64]) -> list[Loop] | None:
    """Return the loops of vertices around a patch, inside on the left; None if two loops touch."""
    number = int(faces.max()) + 1
    sides = faces.ravel() * number + np.roll(faces, -1, axis=1).ravel()
    other_way = np.roll(faces, -1, axis=1).ravel() * number + faces.ravel()
    starts, ends = divmod(np.unique(sides[~np.isin(sides, other_way)]), number)
    follow: dict[int, int] = dict(zip(starts.tolist(), ends.tolist(), strict=True))
    if len(follow) < len(starts):
        return None
    loops = []
    while follow:
        start, here = follow.popitem()
        loop = [start]
        while here != start:
            loop.append(here)
            if here not in follow:
                return None
            here = follow.pop(here)
        loops.append(loop)
    return loops


def _corners(vertices: NDArray[np.float64], loop: Loop) -> Loop:
    """Return the loop without the vertices that lie on a straight line between their neighbours."""
    points = vertices[loop]
    before, after = points - np.roll(points, 1, axis=0), np.roll(points, -1, axis=0) - points
    sine = np.linalg.norm(np.cross(before, after), axis=1)
    bent = sine > STRAIGHT * np.linalg.norm(before, axis=1) * np.linalg.norm(after, axis=1)
    return [vertex for vertex, keep in zip(loop, bent, strict=True) if keep]
