"""Intersecting pairs of boxes from two sets, found with a bounding volume hierarchy."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from optisense.array_types import FloatArray, IntArray

_GROUP = 4
"""Number of boxes of one level that a box of the next level encloses: each pair of boxes that
overlap gives 16 pairs of the level below, which NumPy tests at once."""

_FEW = 64
"""Number of boxes up to which a level is the last one: the 4,096 pairs of two such levels are
compared directly."""

_AT_ONCE = 100_000
"""Number of pairs of boxes that are processed together, which bounds the memory of the arrays to
some 80 MB."""

_DENSE = 1_000_000
"""Number of pairs up to which all are compared directly, which takes some milliseconds and is
faster than grouping them."""

_BLOCK = 64
"""Number of consecutive boxes that are first tested together. Consecutive faces of a mesh mostly
lie close to one another, so that most blocks are ruled out at once."""

_SPREADING = (
    (32, 0x001F00000000FFFF), (16, 0x001F0000FF0000FF), (8, 0x100F00F00F00F00F),
    (4, 0x10C30C30C30C30C3), (2, 0x1249249249249249),
)  # fmt: skip
"""Shifts and masks that spread the bits of a number, with two free places between any two."""


class _Boxes(NamedTuple):
    """Boxes in an order in which neighbours are close, and boxes around groups of them.

    Attributes:
        order: (n,) the given number of each box of the lowest level.
        levels: (low, high) of each level, (k, 3) each, the given boxes first.
    """

    order: IntArray
    levels: list[tuple[FloatArray, FloatArray]]


def overlapping_boxes(
    low_1: FloatArray, high_1: FloatArray, low_2: FloatArray, high_2: FloatArray
) -> tuple[IntArray, IntArray]:
    """Return the pairs of boxes of two sets that overlap or touch, in no particular order.

    Args:
        low_1, high_1: (n, 3) lower and upper corners of the first set.
        low_2, high_2: (k, 3) lower and upper corners of the second set.

    Returns:
        The numbers (p,) in the first set and (p,) in the second set.
    """
    kept_1, kept_2 = _in_reach(low_1, high_1, low_2, high_2)
    low_1, high_1, low_2, high_2 = low_1[kept_1], high_1[kept_1], low_2[kept_2], high_2[kept_2]
    if len(kept_1) * len(kept_2) <= _DENSE:
        one, other = np.nonzero(_all_meeting(low_1, high_1, low_2, high_2))
    else:
        one, other = _descend(_grouped(low_1, high_1), _grouped(low_2, high_2), same=False)
    return kept_1[one], kept_2[other]


def overlapping_pairs(low: FloatArray, high: FloatArray) -> tuple[IntArray, IntArray]:
    """Return the pairs of boxes of one set that overlap or touch; each pair once.

    Args:
        low, high: (n, 3) lower and upper corners.

    Returns:
        The smaller (p,) and the larger number (p,) of each pair.
    """
    if len(low) ** 2 <= _DENSE:
        one, other = np.nonzero(np.triu(_all_meeting(low, high, low, high), k=1))
        return one.astype(np.int64), other.astype(np.int64)
    boxes = _grouped(low, high)
    one, other = _descend(boxes, boxes, same=True)
    return np.minimum(one, other), np.maximum(one, other)


def _in_reach(
    low_1: FloatArray, high_1: FloatArray, low_2: FloatArray, high_2: FloatArray
) -> tuple[IntArray, IntArray]:
    """Return the boxes of each set that may overlap one of the other, which are usually few.

    They overlap the box around all blocks of the other set that overlap a block of their own set.
    """
    if len(low_1) * len(low_2) == 0:
        return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)
    blocks_1, blocks_2 = _blocks(low_1, high_1), _blocks(low_2, high_2)
    near = _all_meeting(*blocks_1, *blocks_2)
    reached = []
    for low, high, axis, others in ((low_1, high_1, 1, blocks_2), (low_2, high_2, 0, blocks_1)):
        own, theirs = np.flatnonzero(near.any(axis=axis)), np.flatnonzero(near.any(axis=1 - axis))
        boxes = (own[:, None] * _BLOCK + np.arange(_BLOCK)).ravel()
        boxes = boxes[boxes < len(low)].astype(np.int64)
        if len(theirs):
            around = others[0][theirs].min(axis=0), others[1][theirs].max(axis=0)
            boxes = boxes[((low[boxes] <= around[1]) & (high[boxes] >= around[0])).all(axis=1)]
        reached.append(boxes)
    return reached[0], reached[1]


def _blocks(low: FloatArray, high: FloatArray) -> tuple[FloatArray, FloatArray]:
    starts = np.arange(0, len(low), _BLOCK)
    return np.minimum.reduceat(low, starts), np.maximum.reduceat(high, starts)


def _all_meeting(
    low_1: FloatArray, high_1: FloatArray, low_2: FloatArray, high_2: FloatArray
) -> NDArray[np.bool_]:
    """Return a mask (n, k) of the overlaps between n boxes and k others."""
    meet = np.ones((len(low_1), len(low_2)), dtype=bool)
    for axis in range(3):
        meet &= low_1[:, None, axis] <= high_2[:, axis]
        meet &= high_1[:, None, axis] >= low_2[:, axis]
    return meet


def _grouped(low: FloatArray, high: FloatArray) -> _Boxes:
    order = np.argsort(_along_a_curve(0.5 * (low + high)), kind="stable").astype(np.int64)
    levels = [(low[order], high[order])]
    while len(levels[-1][0]) > _FEW:
        below_low, below_high = levels[-1]
        starts = np.arange(0, len(below_low), _GROUP)
        levels.append(
            (np.minimum.reduceat(below_low, starts), np.maximum.reduceat(below_high, starts))
        )
    return _Boxes(order, levels)


def _along_a_curve(points: FloatArray) -> NDArray[np.uint64]:
    """Return each point's position (n,) on a Z-order curve (Morton, 1966), with 16 bits per
    axis.
    """
    start, size = points.min(axis=0), np.ptp(points, axis=0).max()
    cells = ((points - start) * (65535.0 / max(size, 1e-300))).astype(np.uint64)
    key = np.zeros(len(points), dtype=np.uint64)
    for axis in range(3):
        bits = cells[:, axis]
        for shift, mask in _SPREADING:
            bits = (bits | (bits << np.uint64(shift))) & np.uint64(mask)
        key |= bits << np.uint64(axis)
    return key


def _descend(first: _Boxes, second: _Boxes, same: bool) -> tuple[IntArray, IntArray]:
    """Descend from the outermost boxes into pairs that overlap.

    Args:
        first, second: the boxes of both sets.
        same: whether both are the same set; each pair is then returned once, and no box with
            itself.
    """
    level_1, level_2 = len(first.levels) - 1, len(second.levels) - 1
    count_1, count_2 = len(first.levels[-1][0]), len(second.levels[-1][0])
    a, b = np.divmod(np.arange(count_1 * count_2, dtype=np.int64), count_2)
    found = [(np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64))]
    waiting = [_those_that_meet(first, second, level_1, level_2, a, b, same)]
    levels = [(level_1, level_2)]
    while waiting:
        (a, b), (level_1, level_2) = waiting.pop(), levels.pop()
        if level_1 == level_2 == 0:
            found.append((first.order[a], second.order[b]))
            continue
        if len(a) > _AT_ONCE:
            waiting += [(a[_AT_ONCE:], b[_AT_ONCE:])]
            levels += [(level_1, level_2)]
        inner = _children(first, second, level_1, level_2, a[:_AT_ONCE], b[:_AT_ONCE])
        level_1, level_2 = max(level_1 - 1, 0), max(level_2 - 1, 0)
        waiting += [_those_that_meet(first, second, level_1, level_2, *inner, same)]
        levels += [(level_1, level_2)]
    ones, others = zip(*found, strict=True)
    return np.concatenate(ones), np.concatenate(others)


def _children(
    first: _Boxes, second: _Boxes, level_1: int, level_2: int, a: IntArray, b: IntArray
) -> tuple[IntArray, IntArray]:
    """Return all pairs of the children of pairs of boxes; a box of the lowest level is its own
    child.
    """
    inner = np.arange(_GROUP, dtype=np.int64)
    below_1 = _GROUP * a[:, None] + inner if level_1 else a[:, None]
    below_2 = _GROUP * b[:, None] + inner if level_2 else b[:, None]
    shape = (len(a), below_1.shape[1], below_2.shape[1])
    one = np.broadcast_to(below_1[:, :, None], shape).reshape(-1)
    other = np.broadcast_to(below_2[:, None, :], shape).reshape(-1)
    there = one < len(first.levels[max(level_1 - 1, 0)][0])
    there &= other < len(second.levels[max(level_2 - 1, 0)][0])
    return one[there], other[there]


def _those_that_meet(
    first: _Boxes,
    second: _Boxes,
    level_1: int,
    level_2: int,
    a: IntArray,
    b: IntArray,
    same: bool,
) -> tuple[IntArray, IntArray]:
    """Return the pairs of boxes ``a`` of one level and ``b`` of another that overlap, each once if
    ``same``.
    """
    if same:
        wanted = a < b if level_1 == 0 else a <= b
        a, b = a[wanted], b[wanted]
    (low_1, high_1), (low_2, high_2) = first.levels[level_1], second.levels[level_2]
    for axis in range(3):
        meet = low_1[a, axis] <= high_2[b, axis]
        meet &= high_1[a, axis] >= low_2[b, axis]
        a, b = a[meet], b[meet]
    return a, b
