"""Faces that cut through each other, and boxes that overlap, are found, and only those."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from optisense.array_types import FloatArray
from optisense.geometry import TriangleMesh
from optisense.geometry.crossings import (
    crossings,
    overlapping_boxes,
    overlapping_pairs,
    self_crossings,
)


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


def boxes(count: int, size: float, seed: int) -> tuple[FloatArray, FloatArray]:
    """Boxes of all forms, flat ones too, in a room of 10 x 10 x 1."""
    random = np.random.default_rng(seed)
    low = random.uniform(0.0, 1.0, (count, 3)) * (10.0, 10.0, 1.0)
    return low, low + random.choice((0.0, 0.1, 1.0), (count, 3)) * size


def pairs_one_by_one(
    low_1: FloatArray, high_1: FloatArray, low_2: FloatArray, high_2: FloatArray
) -> set[tuple[int, int]]:
    apart = (low_1[:, None] > high_2[None]) | (high_1[:, None] < low_2[None])
    return {(int(a), int(b)) for a, b in np.argwhere(~apart.any(axis=2))}


def as_set(one: FloatArray, other: FloatArray) -> set[tuple[int, int]]:
    found = list(zip(one.tolist(), other.tolist(), strict=True))
    assert len(found) == len(set(found))  # none twice
    return set(found)


@pytest.mark.parametrize("counts", [(0, 5), (7, 9), (900, 1), (1, 900), (700, 900), (65, 2000)])
@pytest.mark.parametrize("order", [(0, 1, 2), (1, 2, 0), (2, 0, 1)])
def test_pairs_are_those_of_comparing_all(
    counts: tuple[int, int], order: tuple[int, int, int]
) -> None:
    one = [corners[:, order] for corners in boxes(counts[0], 1.0, 1)]
    other = [corners[:, order] for corners in boxes(counts[1], 0.5, 2)]
    assert as_set(*overlapping_boxes(*one, *other)) == pairs_one_by_one(*one, *other)


@pytest.mark.parametrize("count", [3, 64, 65, 1000])
def test_pairs_of_one_lot_come_once(count: int) -> None:
    low, high = boxes(count, 1.0, 3)
    everything = pairs_one_by_one(low, high, low, high)
    assert as_set(*overlapping_pairs(low, high)) == {(a, b) for a, b in everything if a < b}


def test_boxes_that_touch_meet_and_equal_points_do_not_hinder() -> None:
    corner = np.zeros((400, 3))
    one, other = overlapping_boxes(corner, corner + 1.0, corner + 1.0, corner + 2.0)
    assert len(one) == len(other) == 400 * 400
    one, other = overlapping_boxes(corner, corner + 1.0, corner + 1.0 + 1e-9, corner + 2.0)
    assert len(one) == 0
