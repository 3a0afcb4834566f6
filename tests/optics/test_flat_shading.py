"""Facets that remain flat because the mesh says so."""

from __future__ import annotations

import numpy as np

from optisense.geometry import TriangleMesh, cage_points
from optisense.geometry.cage import deformed
from optisense.optics.scene.assembly import AssemblyCache
from optisense.optics.scene.surfaces import Surface, SurfaceKind
from optisense.sensors._shapes import arc, ribbon


def test_facets_with_their_own_normals_remain_flat() -> None:
    sheet = ribbon(arc((0.0, 0.0), 5.0, 0.0, 90.0, 5), 3.0, 4)
    corners = sheet.triangles.reshape(-1, 3)
    faces = np.arange(len(corners)).reshape(-1, 3)
    cache = AssemblyCache()
    for normals, flat in ((np.repeat(sheet.face_normals, 3, axis=0), True), (None, False)):
        mesh = cache.merge(TriangleMesh(corners, faces, normals))
        assert len(mesh.faces) == 10
        piece = cache.piece("mirror", mesh, Surface(SurfaceKind.MIRROR))
        assert (piece.normals is None) == flat


def test_facets_with_their_own_normals_remain_apart_in_a_cage() -> None:
    sheet = ribbon(arc((0.0, 0.0), 5.0, 0.0, 90.0, 5), 3.0, 4)
    corners = sheet.triangles.reshape(-1, 3)
    faces = np.arange(len(corners)).reshape(-1, 3)
    mesh = TriangleMesh(corners, faces, np.repeat(sheet.face_normals, 3, axis=0))
    box = mesh.bounds + [[-1.0], [1.0]]
    points = cage_points(box, (3, 3, 3))
    for moved, most in ((0.0, 0.0), (0.5, 1.5)):
        points[13] += moved
        cache = AssemblyCache()
        merged = cache.merge(deformed(mesh, box, (3, 3, 3), points))
        piece = cache.piece("mirror", merged, Surface(SurfaceKind.MIRROR))
        assert (piece.normals is None) == (moved == 0.0)
        if piece.normals is not None:
            whole = TriangleMesh(piece.vertices, piece.faces)
            cosine = np.einsum("fci,fi->fc", piece.normals[piece.faces], whole.face_normals)
            assert cosine.min() > np.cos(np.radians(most))  # 9 degrees if facets were smoothed
            assert len(piece.vertices) == 5 * 10


def test_facets_with_vertices_of_their_own_but_without_normals_are_smooth() -> None:
    sheet = ribbon(arc((0.0, 0.0), 5.0, 0.0, 90.0, 9), 3.0, 1)
    facets = [sheet.with_faces(sheet.faces[[k, k + 9]]).compacted() for k in range(9)]
    cache = AssemblyCache()
    mesh = cache.merge(TriangleMesh.joined(facets))
    piece = cache.piece("mirror", mesh, Surface(SurfaceKind.MIRROR))
    assert piece.normals is not None


def test_flat_faces_remain_flat_when_they_become_single_triangles() -> None:
    corners = np.array([[4, 4, 0], [-4, 4, 0], [-4, -4, 0], [4, -4, 0], [0, 0, 1]])
    sides = np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]])
    middles = 5 + np.arange(4)
    faces = [np.column_stack([sides[:, [k, (k + 1) % 3]], middles]) for k in range(3)]
    vertices = np.concatenate([corners, corners[sides].mean(axis=1)])
    cache = AssemblyCache()
    mesh = cache.merge(TriangleMesh(vertices, np.concatenate(faces)))
    assert len(mesh.faces) == 4
    assert cache.piece("mirror", mesh, Surface(SurfaceKind.MIRROR)).normals is None
