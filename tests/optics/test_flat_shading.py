"""Facets that remain flat because the mesh says so."""

from __future__ import annotations

import numpy as np

from optisense.geometry import TriangleMesh
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
