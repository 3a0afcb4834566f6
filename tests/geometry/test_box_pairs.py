"""Boxes that overlap are found, and only those."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest

from optisense.array_types import FloatArray
from optisense.geometry import TriangleMesh
from optisense.geometry._box_pairs import (
    PAIRS_AT_ONCE,
    BoxPairs,
    overlapping_boxes,
    overlapping_pairs,
)


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


def as_set(batches: BoxPairs) -> set[tuple[int, int]]:
    found = [
        pair for one, other in batches for pair in zip(one.tolist(), other.tolist(), strict=True)
    ]
    assert len(found) == len(set(found))  # none twice
    return set(found)


@pytest.mark.parametrize("counts", [(0, 5), (7, 9), (900, 1), (1, 900), (700, 900), (65, 2000)])
@pytest.mark.parametrize("order", [(0, 1, 2), (1, 2, 0), (2, 0, 1)])
def test_pairs_are_those_of_comparing_all(
    counts: tuple[int, int], order: tuple[int, int, int]
) -> None:
    one = [corners[:, order] for corners in boxes(counts[0], 1.0, 1)]
    other = [corners[:, order] for corners in boxes(counts[1], 0.5, 2)]
    assert as_set(overlapping_boxes(*one, *other)) == pairs_one_by_one(*one, *other)


@pytest.mark.parametrize("count", [3, 64, 65, 1000])
def test_pairs_of_one_lot_come_once(count: int) -> None:
    low, high = boxes(count, 1.0, 3)
    everything = pairs_one_by_one(low, high, low, high)
    assert as_set(overlapping_pairs(low, high)) == {(a, b) for a, b in everything if a < b}


def test_boxes_that_touch_meet_and_equal_points_do_not_hinder() -> None:
    corner = np.zeros((400, 3))
    met = as_set(overlapping_boxes(corner, corner + 1.0, corner + 1.0, corner + 2.0))
    assert len(met) == 400 * 400
    apart = overlapping_boxes(corner, corner + 1.0, corner + 1.0 + 1e-9, corner + 2.0)
    assert next(apart, None) is None


def test_walls_take_no_more_memory_than_their_pairs() -> None:
    """Seen along its height, all faces of a column of a wall lie over one another."""
    bounds = TriangleMesh.box((0, 0, 0), (10, 10, 9), (10, 10, 10)).face_bounds
    everything = pairs_one_by_one(*bounds, *bounds)
    assert as_set(overlapping_pairs(*bounds)) == {(a, b) for a, b in everything if a < b}
    fine = TriangleMesh.box((0, 0, 0), (10, 10, 9), (50, 50, 50)).face_bounds
    tracemalloc.start()
    counts = [len(one) for one, _ in overlapping_pairs(*fine)]
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert sum(counts) < 12 * len(fine[0])
    assert max(counts) <= PAIRS_AT_ONCE
    assert peak < 50e6
