"""Pareto dominance of outcomes for several goals."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from optisense.array_types import BoolArray, FloatArray, IntArray


def dominates(values: FloatArray, broken: ArrayLike) -> BoolArray:
    """Return whether i dominates j, (k, k) bool: its violation of the conditions is smaller, or as
    large and it is at least as good in all goals and better in one, where higher is better
    (constrained domination: Deb et al., 2002, section VI).

    Args:
        values: values of the goals, (k, m); a failed trial has NaN, and all others dominate it.
        broken: violation of the conditions of each, (k,), 0 where all are met.
    """
    fine = _fine(values)
    known, amount = np.where(fine[:, None], values, -np.inf), np.where(fine, broken, np.inf)
    never_worse = (known[:, None] >= known[None]).all(axis=2)
    better = (known[:, None] > known[None]).any(axis=2)
    less, same = amount[:, None] < amount[None], amount[:, None] == amount[None]
    return np.asarray(less | (same & never_worse & better))


def front(values: FloatArray) -> IntArray:
    """Return the indices of the values (k, m) that no other dominates, in order, without failed
    ones. Duplicates of a value are all kept.
    """
    fine = _fine(values)
    kept: list[int] = []
    # After sorting by the first goal a value can be dominated only by values before it.
    order = np.lexsort(-values.T[::-1])
    for number in order[fine[order]]:
        best = values[kept]
        worse = (best >= values[number]).all(axis=1) & (best > values[number]).any(axis=1)
        if not worse.any():
            kept.append(int(number))
    return np.array(sorted(kept), dtype=np.int64)


def ranks(values: FloatArray, broken: ArrayLike) -> IntArray:
    """Return the ranks (k,) of values (k, m): 0 for the Pareto front, 1 for the front of the rest,
    and so on (Deb et al., "A fast and elitist multiobjective genetic algorithm: NSGA-II", 2002).
    """
    dominated = dominates(values, broken)
    rank = np.full(len(dominated), -1, dtype=np.int64)
    left = np.ones(len(dominated), dtype=bool)
    level = 0
    while left.any():
        first = left & ~dominated[left].any(axis=0)
        rank[first] = level
        left &= ~first
        level += 1
    return rank


def crowding(values: FloatArray, rank: IntArray) -> FloatArray:
    """Return the crowding distance (k,) of each value among those of its rank, infinite at the ends
    (Deb et al., 2002).
    """
    room = np.zeros(len(values))
    for level in np.unique(rank):
        members = np.flatnonzero(rank == level)
        part = values[members]
        if not np.isfinite(part).all():
            continue
        for goal in part.T:
            order = np.argsort(goal, kind="stable")
            span = goal[order[-1]] - goal[order[0]]
            room[members[order[[0, -1]]]] = np.inf
            if span > 0.0 and len(order) > 2:
                room[members[order[1:-1]]] += (goal[order[2:]] - goal[order[:-2]]) / span
    return room


def _fine(values: FloatArray) -> BoolArray:
    """Return which values have no NaN, (k,) bool."""
    return np.asarray(np.isfinite(values).all(axis=1))
