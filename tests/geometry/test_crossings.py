"""Faces that cut through each other are found, and only those."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from optisense.geometry import TriangleMesh
from optisense.geometry.crossings import crossings, self_crossings


def ball(radius: float, centre: tuple[float, float, float] = (0, 0, 0)) -> TriangleMesh:
    mesh = trimesh.creation.icosphere(subdivisions=3, radius=radius)
    return TriangleMesh(mesh.vertices + np.array(centre), mesh.faces)


@pytest.mark.parametrize("mesh", [ball(5.0), TriangleMesh.box((0, 0, 0), (9, 8, 1), (20, 20, 9))])
def test_a_sound_mesh_does_not_cross_itself(mesh: TriangleMesh) -> None:
    assert len(self_crossings(mesh).pairs) == 0


def test_two_balls_cross_in_a_circle() -> None:
    """Spheres of radius 5 with centres 6 apart meet in a circle of radius 4 half way."""
    one, other = ball(5.0), ball(5.0, (6.0, 0.0, 0.0))
    found = crossings(one, other)
    assert len(found.pairs) > 20
    assert found.places[:, 0] == pytest.approx(3.0, abs=0.1)
    assert np.linalg.norm(found.places[:, 1:], axis=1) == pytest.approx(4.0, abs=0.1)
    together = self_crossings(TriangleMesh.joined([one, other]))
    assert len(together.pairs) == len(found.pairs)


def test_each_pair_has_the_place_in_both_of_its_faces() -> None:
    one, other = ball(5.0), ball(4.0, (5.0, 1.0, 2.0))
    found = crossings(one, other)
    for (first, second), place in zip(found.pairs, found.places, strict=True):
        for mesh, face in ((one, first), (other, second)):
            height = (place - mesh.triangles[face, 0]) @ mesh.face_normals[face]
            assert abs(height) < 1e-9


def test_solids_that_touch_do_not_cross() -> None:
    below = TriangleMesh.box((0, 0, 0), (4, 4, 1), (3, 3, 1))
    for shift in ((0, 0, 1), (1, 1, 1), (4, 0, 0)):
        beside = below.with_vertices(below.vertices + np.array(shift))
        assert len(crossings(below, beside).pairs) == 0
    sunk = below.with_vertices(below.vertices + np.array([1.0, 1.0, 0.5]))
    assert len(crossings(below, sunk).pairs) > 0


def test_looking_ends_at_the_limit() -> None:
    assert len(crossings(ball(5.0), ball(5.0, (6, 0, 0)), limit=3).pairs) == 3
