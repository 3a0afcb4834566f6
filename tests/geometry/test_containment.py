"""Points in and out of closed meshes, by rays and by solid angle."""

from __future__ import annotations

import numpy as np
import pytest

from optisense.geometry import TriangleMesh
from optisense.geometry.containment import RAY_DIRECTION, _turns, inside
from optisense.sensors._shapes import arc, revolve


def _ball(radius: float) -> TriangleMesh:
    half = arc((0.0, 0.0), radius, -90.0, 90.0, 30)
    half[[0, -1], 0] = 0.0
    return revolve(half, 48)


def test_a_box_by_its_bounds() -> None:
    box = TriangleMesh.box((-1.0, -2.0, -3.0), (1.0, 2.0, 3.0), (3, 4, 5))
    points = np.random.default_rng(1).uniform(-4.0, 4.0, (500, 3))
    expected = (np.abs(points) < (1.0, 2.0, 3.0)).all(axis=1)
    np.testing.assert_array_equal(inside(points, box), expected)


def test_a_hollow_ball_by_the_distance() -> None:
    shell = TriangleMesh.joined([_ball(5.0), _ball(3.0).flipped()])
    points = np.random.default_rng(2).normal(size=(500, 3))
    points *= np.random.default_rng(3).uniform(0.1, 6.0, 500)[:, None] / np.linalg.norm(
        points, axis=1, keepdims=True
    )
    distance = np.linalg.norm(points, axis=1)
    clear = (np.abs(distance - 5.0) > 0.05) & (np.abs(distance - 3.0) > 0.05)
    expected = (distance < 5.0) & (distance > 3.0)
    np.testing.assert_array_equal(inside(points, shell)[clear], expected[clear])


def test_faces_that_look_inward_make_no_difference() -> None:
    points = np.array([(0.0, 0.0, 0.0), (0.0, 0.0, 9.0)])
    assert inside(points, _ball(5.0).flipped()).tolist() == [True, False]


@pytest.mark.parametrize("share", [0.0, 0.5])
def test_a_ray_through_an_edge_or_a_corner(share: float) -> None:
    """A ray that meets an edge is counted exactly once."""
    box = TriangleMesh.box((-1.0, -1.0, -1.0), (1.0, 1.0, 1.0), (2, 2, 2))
    on_edge = np.array([share, 0.0, 1.0])  # on an edge of the top's grid
    below, above = on_edge - 0.5 * RAY_DIRECTION, on_edge + 0.5 * RAY_DIRECTION
    assert inside([below, above], box).tolist() == [True, False]


def test_rays_agree_with_solid_angles() -> None:
    closed = _ball(2.0)
    points = np.random.default_rng(4).uniform(-2.0, 2.0, (60, 3))
    expected = [_turns(closed, point) != 0 for point in points]
    assert inside(points, closed).tolist() == expected


def test_many_points_are_tested_as_each_alone() -> None:
    mesh = TriangleMesh.box((-1, -1, -1), (1, 1, 1))
    points = np.random.default_rng(0).uniform(-1.2, 1.2, (100, 3))
    points[::10, :2] = 0.0  # rays from these may meet edges
    together = inside(points, mesh)
    assert together.any() and not together.all()
    assert together.tolist() == [bool(inside(point, mesh)[0]) for point in points]
