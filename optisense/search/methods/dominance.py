"""Pareto dominance of outcomes for several goals."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from optisense.array_types import FloatArray


def dominates(values: ArrayLike, broken: ArrayLike | None = None) -> NDArray[np.bool_]:
    """Return whether i dominates j, (k, k) bool: it is at least as good in all goals and better in
    one, where higher is better.

    If conditions are broken this is constrained domination (Deb et al., 2002, section VI): the
    point with the smaller violation dominates.

    Args:
        values: values of the goals, (k, m); a failed trial has NaN, and all others dominate it.
        broken: violation of the conditions of each, (k,), 0 where all are met; all are met if None.
    """
    given = np.asarray(values, dtype=np.float64)
    known = np.where(_fine(given)[:, None], given, -np.inf)
    never_worse = (known[:, None] >= known[None]).all(axis=2)
    better = (known[:, None] > known[None]).any(axis=2)
    found = never_worse & better
    if broken is not None:
        amount = np.where(_fine(given), np.asarray(broken, dtype=np.float64), np.inf)
        less, same = amount[:, None] < amount[None], amount[:, None] == amount[None]
        found = less | (same & found)
    return np.asarray(found)


def front(values: ArrayLike) -> NDArray[np.int64]:
    """Return the indices of the values (k, m) that no other dominates, in order, without failed
    ones.

    Duplicates of a value are all kept.
    """
    given = np.asarray(values, dtype=np.float64)
    if not len(given):
        return np.empty(0, dtype=np.int64)
    fine = _fine(given)
    kept: list[int] = []
    # After sorting by the first goal a value can be dominated only by values before it.
    order = np.lexsort(tuple(-given[:, k] for k in reversed(range(given.shape[1]))))
    for number in order[fine[order]]:
        best = given[kept]
        worse = (best >= given[number]).all(axis=1) & (best > given[number]).any(axis=1)
        if not worse.any():
            kept.append(int(number))
    return np.array(sorted(kept), dtype=np.int64)


def ranks(values: ArrayLike, broken: ArrayLike | None = None) -> NDArray[np.int64]:
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


def crowding(values: ArrayLike, rank: NDArray[np.int64]) -> FloatArray:
    """Return the crowding distance (k,) of each value among those of its rank, infinite at the ends
    (Deb et al., 2002).
    """
    given = np.asarray(values, dtype=np.float64)
    room = np.zeros(len(given))
    for level in np.unique(rank):
        members = np.flatnonzero(rank == level)
        part = given[members]
        if not np.isfinite(part).all():
            continue
        for goal in part.T:
            order = np.argsort(goal, kind="stable")
            span = goal[order[-1]] - goal[order[0]]
            room[members[order[[0, -1]]]] = np.inf
            if span > 0.0 and len(order) > 2:
                room[members[order[1:-1]]] += (goal[order[2:]] - goal[order[:-2]]) / span
    return room


def _fine(values: FloatArray) -> NDArray[np.bool_]:
    """Return which values have no NaN, (k,) bool."""
    return np.asarray(np.isfinite(values).all(axis=1))
