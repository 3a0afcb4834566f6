"""Every combination of the steps and options of all parameters."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from optisense.errors import SearchError
from optisense.search.evaluation.outcome import Outcome
from optisense.search.methods.base import FloatArray, Method, Problem
from optisense.search.space.search_space import BoundSpace

GENERATION = 512
"""Combinations that are proposed together: enough for many workers."""


class Grid(Method):
    """Every combination; the last parameter changes fastest."""

    name = "grid"
    summary = "every combination of steps and options"

    def __init__(self, problem: Problem) -> None:
        super().__init__(problem)
        self._levels = _levels(problem.space)
        self._counts = [len(levels) for levels in self._levels]
        self.size = math.prod(self._counts)
        if problem.budget < self.size:
            raise SearchError(
                f"the grid has {self.size:,} designs, the budget is {problem.budget:,}",
                hint="Leave --budget out, take fewer steps, or use another method",
            )
        self._next = 0

    @classmethod
    def usual_budget(cls, space: BoundSpace) -> int:
        """All combinations."""
        return math.prod(len(levels) for levels in _levels(space))

    def ask(self) -> FloatArray:
        """The next combinations, (k, n)."""
        last = min(self._next + GENERATION, self.size)
        numbers = np.arange(self._next, last)
        places = np.array(np.unravel_index(numbers, self._counts)).T.reshape(-1, self.space.size)
        self._next = last
        columns = [np.array(self._levels[k])[places[:, k]] for k in range(self.space.size)]
        return np.stack(columns, axis=1) if len(numbers) else np.empty((0, self.space.size))

    def tell(self, vectors: FloatArray, outcomes: Sequence[Outcome]) -> None:
        """A grid learns nothing."""


def _levels(space: BoundSpace) -> list[tuple[float, ...]]:
    found = []
    for parameter in space.parameters:
        levels = parameter.kind.levels
        if levels is None:
            raise SearchError(
                "a grid needs to know the number of steps",
                where=parameter.name,
                hint=f"Write {parameter.asked}=LOW:HIGH:STEPS",
            )
        found.append(levels)
    return found
