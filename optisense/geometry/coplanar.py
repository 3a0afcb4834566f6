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
"""Distance (mm) below which a point lies in a plane, in a mesh close to the origin: files often
round coordinates to this step."""
SINGLE_PRECISION = 2.0**-22
"""The same distance over the largest coordinate, without a unit, in a mesh farther away: four times
the rounding of a coordinate in single precision, as four rounded points determine the distance."""
STRAIGHT = 1e-6
"""Sine of the angle between the sides of a corner (6e-5 degrees) below which the outline is
straight there, so that the corner is not needed."""

Loop = list[int]


def merge_coplanar(mesh: TriangleMesh) -> TriangleMesh:
    """Triangulate every flat, connected patch of triangles of a mesh again from its outline.

    Patches keep their outlines, except for points along straight lines, which all patches that
    touch there leave out alike, so that a closed mesh remains closed. Shading normals are dropped,
    so this is for meshes with flat facets. A patch whose outline touches itself is not changed.
    """
    mesh = mesh.welded()
    room = max(SAME_PLANE, SINGLE_PRECISION * float(np.abs(mesh.vertices).max(initial=0.0)))
    patches = _patches(mesh, room)
    members = np.split(np.argsort(patches, kind="stable"), np.cumsum(np.bincount(patches))[:-1])
    parts = [np.asarray(mesh.faces[each], dtype=np.int64) for each in members]
    outlines = [_outline(part) if len(part) > 2 else None for part in parts]
    needed = np.zeros(len(mesh.vertices), dtype=bool)
    for part, outline in zip(parts, outlines, strict=True):
        needed[part if outline is None else _corners(mesh.vertices, outline)] = True
    faces = [
        part if outline is None else _triangulated(mesh, part, outline, needed)
        for part, outline in zip(parts, outlines, strict=True)
    ]
    merged = TriangleMesh(mesh.vertices, np.concatenate(faces).astype(np.int32)).compacted()
    return merged if merged.is_closed or not mesh.is_closed else mesh


def _patches(mesh: TriangleMesh, room: float) -> NDArray[np.int64]:
    """Return the number (m,) of the connected patch, whose neighbours' vertices lie within ``room``
    (mm) of each other's planes, that each face belongs to.
    """
    normals = mesh.face_normals
    one, other = inner_edges(mesh)[1].T
    flat = np.einsum("ij,ij->i", normals[one], normals[other]) > 1 - SAME_DIRECTION
    for face, neighbour in ((one, other), (other, one)):
        offsets = mesh.triangles[neighbour] - mesh.triangles[face][:, :1]
        flat &= (np.abs(np.einsum("ikj,ij->ik", offsets, normals[face])) < room).all(axis=1)
    return connected_components(len(mesh.faces), one[flat], other[flat])


def _triangulated(
    mesh: TriangleMesh, faces: NDArray[np.int64], outline: list[Loop], needed: NDArray[np.bool_]
) -> NDArray[np.int64]:
    """Return new faces for a patch from the needed vertices of its outline, or its faces if there
    would not be fewer.
    """
    loops = [[vertex for vertex in loop if needed[vertex]] for loop in outline]
    if any(len(loop) < 3 for loop in loops):
        return faces
    a, b, c = mesh.vertices[faces[0]]
    x = (b - a) / np.linalg.norm(b - a)
    normal = np.cross(b - a, c - a)
    y = np.cross(normal / np.linalg.norm(normal), x)
    flat = [np.stack([mesh.vertices[loop] @ x, mesh.vertices[loop] @ y], axis=1) for loop in loops]
    corners = np.concatenate([np.asarray(loop, dtype=np.int64) for loop in loops])
    triangles = np.asarray(manifold3d.triangulate(flat), dtype=np.int64)
    if len(triangles) == 0 or len(triangles) >= len(faces):
        return faces
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


def _corners(vertices: NDArray[np.float64], outline: list[Loop]) -> Loop:
    """Return the vertices of loops that don't lie on a straight line between their neighbours."""
    corners: Loop = []
    for loop in outline:
        points = vertices[loop]
        before, after = points - np.roll(points, 1, axis=0), np.roll(points, -1, axis=0) - points
        sine = np.linalg.norm(np.cross(before, after), axis=1)
        bent = sine > STRAIGHT * np.linalg.norm(before, axis=1) * np.linalg.norm(after, axis=1)
        corners += [vertex for vertex, keep in zip(loop, bent, strict=True) if keep]
    return corners
