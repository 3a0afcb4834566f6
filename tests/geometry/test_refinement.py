"""Bisection of triangles."""

import numpy as np
import pytest

from optisense.geometry import TriangleMesh
from optisense.geometry.refinement import refine


def refined(max_faces=10**6):
    mesh = TriangleMesh.grid((10.0, 8.0), (2, 3))
    normals = np.broadcast_to([0.0, 0.0, 1.0], (len(mesh.faces), 3, 3))

    def wanted(places):
        return np.clip(0.3 * np.linalg.norm(places[:, :2] - [1.0, 2.0], axis=1), 0.1, 1.0)

    return wanted, *refine(mesh.vertices, mesh.faces.astype(np.int64), normals, wanted, max_faces)


def test_edges_are_as_short_as_wanted_and_the_surface_stays():
    wanted, vertices, faces, normals = refined()
    ends = vertices[faces[:, [[0, 1], [1, 2], [2, 0]]]]
    length = np.linalg.norm(ends[:, :, 0] - ends[:, :, 1], axis=2)
    assert (length <= wanted(ends.mean(axis=2).reshape(-1, 3)).reshape(length.shape)).all()
    mesh = TriangleMesh(vertices, faces)
    assert mesh.area == pytest.approx(80.0)
    assert mesh.face_normals == pytest.approx(np.tile([0, 0, 1.0], (len(faces), 1)))
    assert normals.shape == (len(faces), 3, 3)


def test_no_vertex_lies_inside_an_edge_of_another_triangle():
    _, vertices, faces, _ = refined()
    ends = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    edges, count = np.unique(ends, axis=0, return_counts=True)
    on_rim = np.isclose(np.abs(vertices[edges, 0]), 5.0).all(axis=1)
    on_rim |= np.isclose(np.abs(vertices[edges, 1]), 4.0).all(axis=1)
    assert (count == np.where(on_rim, 1, 2)).all()


def test_a_limit_of_triangles_is_kept():
    _, _, faces, _ = refined(max_faces=500)
    assert 12 < len(faces) <= 500
