"""Intersecting pairs of boxes from two sets."""

from __future__ import annotations

import numpy as np

from optisense.array_types import FloatArray, IntArray


def overlapping_boxes(
    low_1: FloatArray, high_1: FloatArray, low_2: FloatArray, high_2: FloatArray
) -> tuple[IntArray, IntArray]:
    """Return the pairs of boxes of two sets that overlap or touch, in no particular order.

    A tree of rectangles finds the pairs that overlap when seen along the axis over which the boxes
    extend least, and few of these lie behind one another.

    Args:
        low_1, high_1: (n, 3) lower and upper corners of the first set.
        low_2, high_2: (k, 3) lower and upper corners of the second set.

    Returns:
        The numbers (p,) in the first set and (p,) in the second set.
    """
    from shapely import STRtree, box

    reached_1 = _in_reach(low_1, high_1, low_2, high_2)
    reached_2 = _in_reach(low_2, high_2, low_1, high_1)
    if not (len(reached_1) and len(reached_2)):
        return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)
    low_1, high_1, low_2, high_2 = (
        low_1[reached_1], high_1[reached_1], low_2[reached_2], high_2[reached_2],
    )  # fmt: skip
    extent = np.maximum(high_1.max(axis=0), high_2.max(axis=0)) - np.minimum(
        low_1.min(axis=0), low_2.min(axis=0)
    )
    along, *across = np.argsort(extent)
    tree = STRtree(box(*low_2[:, across].T, *high_2[:, across].T))
    one, other = tree.query(box(*low_1[:, across].T, *high_1[:, across].T))
    meet = (low_1[one, along] <= high_2[other, along]) & (high_1[one, along] >= low_2[other, along])
    return reached_1[one[meet]], reached_2[other[meet]]


def overlapping_pairs(low: FloatArray, high: FloatArray) -> tuple[IntArray, IntArray]:
    """Return the pairs of boxes of one set that overlap or touch; each pair once.

    Args:
        low, high: (n, 3) lower and upper corners.

    Returns:
        The smaller (p,) and the larger number (p,) of each pair.
    """
    one, other = overlapping_boxes(low, high, low, high)
    ordered = one < other
    return one[ordered], other[ordered]


def _in_reach(
    low: FloatArray, high: FloatArray, other_low: FloatArray, other_high: FloatArray
) -> IntArray:
    """Return the boxes that overlap the box around all others."""
    if not len(other_low):
        return np.zeros(0, dtype=np.int64)
    reach = (low <= other_high.max(axis=0)) & (high >= other_low.min(axis=0))
    return np.flatnonzero(reach.all(axis=1)).astype(np.int64)
