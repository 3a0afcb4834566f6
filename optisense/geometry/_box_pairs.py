"""Pairs of boxes that overlap, found in trees of boxes.

Each tree groups neighbouring boxes, and these groups again, up to one box around all. Two trees are
descended in tandem: where the boxes around two groups are apart, no pair of their members is
compared (Ericson, "Real-Time Collision Detection", 2005, section 6.3). Time and memory therefore
grow about as the numbers of boxes and of pairs, also if the boxes lie in walls or differ in size.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from optisense.array_types import FloatArray, IntArray

PAIRS_AT_ONCE = 32_768
"""Number of pairs of boxes that are compared or returned together. It bounds the memory of their
arrays to some 10 MB."""

GROUP = 4
"""Number of boxes in a group; with 2 or 8 the search takes about a quarter longer."""

BoxPairs = Iterator[tuple[IntArray, IntArray]]


class _Tree(NamedTuple):
    """A tree of boxes.

    Attributes:
        order: (n,) numbers of the boxes, with neighbours next to one another.
        levels: the boxes (6, k) in this order, the boxes around each `GROUP` of them, and so on up
            to the one around all. The last group of a level is filled up with boxes that overlap
            none. A box is its lowest corner and its highest one, which is negated.
    """

    order: IntArray
    levels: list[FloatArray]

    @staticmethod
    def of(low: FloatArray, high: FloatArray) -> _Tree:
        from scipy.spatial import cKDTree  # takes a tenth of a second to load

        tree = cKDTree(0.5 * (low + high), GROUP, compact_nodes=False, balanced_tree=False)
        boxes = np.concatenate([low.T, -high.T])[:, tree.indices]
        levels: list[FloatArray] = []
        while not levels or boxes.shape[1] > 1:
            none = np.full((6, -boxes.shape[1] % GROUP), np.inf)
            levels.append(np.hstack([boxes, none]))
            boxes = levels[-1].reshape(6, -1, GROUP).min(axis=2)
        return _Tree(tree.indices, [*levels, boxes])


def overlapping_boxes(
    low_1: FloatArray, high_1: FloatArray, low_2: FloatArray, high_2: FloatArray
) -> BoxPairs:
    """Find the pairs of boxes of two sets that overlap or touch, in no particular order.

    Boxes outside of the one around the other set are left out first. The corners are (n, 3) and
    (k, 3). The pairs come in batches, none of which is empty: numbers (p,) in the first set and
    (p,) in the second.
    """
    if not (len(low_1) and len(low_2)):
        return
    lowest = np.maximum(low_1.min(axis=0), low_2.min(axis=0))
    highest = np.minimum(high_1.max(axis=0), high_2.max(axis=0))
    sets = [(low_1, high_1), (low_2, high_2)]
    near = [np.flatnonzero(((low <= highest) & (high >= lowest)).all(axis=1)) for low, high in sets]
    if all(map(len, near)):
        first, second = (
            _Tree.of(low[rows], high[rows]) for rows, (low, high) in zip(near, sets, strict=True)
        )
        for one, other in _descend(first, second):
            yield near[0][one], near[1][other]


def overlapping_pairs(low: FloatArray, high: FloatArray) -> BoxPairs:
    """Find the pairs of boxes with corners (n, 3) that overlap or touch, each pair once.

    The pairs come in batches, none of which is empty: the smaller (p,) and the larger number (p,)
    of each pair.
    """
    if len(low):
        tree = _Tree.of(low, high)
        for one, other in _descend(tree, tree):
            yield np.minimum(one, other), np.maximum(one, other)


def _descend(first: _Tree, second: _Tree) -> BoxPairs:
    """Find the pairs of boxes of two trees that overlap; of a tree and itself, each pair once."""
    opposite = [-np.roll(boxes, 3, axis=0) for boxes in second.levels]
    root = np.zeros(1, dtype=np.int64)
    # Pairs of nodes whose members are still to be compared. Those next to the leaves come first,
    # which keeps their number small.
    waiting = [(len(first.levels) - 1, root, len(second.levels) - 1, root)]
    while waiting:
        level_1, one, level_2, other = waiting.pop()
        if len(one) > PAIRS_AT_ONCE:
            later = slice(PAIRS_AT_ONCE, None)
            waiting.append((level_1, one[later], level_2, other[later]))
            one, other = one[:PAIRS_AT_ONCE], other[:PAIRS_AT_ONCE]
        if level_1 == level_2 == 0:
            yield first.order[one], second.order[other]
            continue
        # The boxes of the members of all nodes of the tree that has more levels left, (6, k, GROUP)
        # or (6, k, 1), and of the nodes of the other tree.
        if level_1 >= level_2:
            level_1 -= 1
            members = first.levels[level_1].reshape(6, -1, GROUP).take(one, axis=1)
            nodes = opposite[level_2].take(other, axis=1)
            pair, member = np.nonzero((members <= nodes[:, :, None]).all(axis=0))
            one, other = one[pair] * GROUP + member, other[pair]
        else:
            level_2 -= 1
            members = opposite[level_2].reshape(6, -1, GROUP).take(other, axis=1)
            nodes = first.levels[level_1].take(one, axis=1)
            pair, member = np.nonzero((nodes[:, :, None] <= members).all(axis=0))
            one, other = one[pair], other[pair] * GROUP + member
        if first is second and level_1 == level_2:
            once = one <= other if level_1 else one < other
            one, other = one[once], other[once]
        if len(one):
            waiting.append((level_1, one, level_2, other))
