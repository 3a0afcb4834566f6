"""Pareto dominance of outcomes when there are several goals."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]


def dominates(values: ArrayLike, broken: ArrayLike | None = None) -> NDArray[np.bool_]:
    """(k, k): whether i is at least as good as j in all goals and better in one; higher is better.

    Where conditions are broken this is constrained domination (Deb et al., 2002, section VI): what
    breaks them less dominates what breaks them more.

    Args:
        values: (k, m), NaN where a trial failed: dominated by all that did not.
        broken: (k,) how far each breaks its conditions, 0 where it meets them; all do if None.
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
    """Indices of the values (k, m) that nothing dominates, failed ones left out; in order.

    Equal values are all kept.
    """
    given = np.asarray(values, dtype=np.float64)
    if not len(given):
        return np.empty(0, dtype=np.int64)
    fine = _fine(given)
    kept: list[int] = []
    # Sorted by the first goal, only what came before can dominate what comes after.
    order = np.lexsort(tuple(-given[:, k] for k in reversed(range(given.shape[1]))))
    for number in order[fine[order]]:
        best = given[kept]
        worse = (best >= given[number]).all(axis=1) & (best > given[number]).any(axis=1)
        if not worse.any():
            kept.append(int(number))
    return np.array(sorted(kept), dtype=np.int64)


def ranks(values: ArrayLike, broken: ArrayLike | None = None) -> NDArray[np.int64]:
    """(k,): 0 for the front, 1 for the front of the rest, and so on (Deb et al., "A fast and
    elitist multiobjective genetic algorithm: NSGA-II", 2002).

    Args:
        values: (k, m), as of `dominates`.
        broken: (k,), as of `dominates`.
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
    """(k,): how much room each value has among those of its rank, infinite at the ends (ibid.)."""
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
    """(k,): which values have no part that failed."""
    return np.asarray(np.isfinite(values).all(axis=1))
