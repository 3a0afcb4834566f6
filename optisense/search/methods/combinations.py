"""Base of methods over combinations of a few levels: no repeats, and hill climbing."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator, Sequence
from itertools import islice, product
from typing import Any

import numpy as np

from optisense.errors import SearchError
from optisense.search.evaluation.outcome import FAILED, Outcome, Rank, rank_of
from optisense.search.methods.base import FloatArray, Method, Problem
from optisense.search.space.search_space import BoundSpace

Combination = tuple[int, ...]
"""The position of a level for each parameter."""

GENERATION = 512
"""Combinations that are proposed together where nothing has to be learned in between."""

Stage = tuple[str, list[Combination]]
"""The name of a stage, and the combinations that it tries."""


class Combinations(Method):
    """Tries combinations of levels by a plan, each once, until the budget is spent.

    Attributes:
        levels: the coordinates that each parameter may take.
        size: how many combinations there are.
    """

    def __init__(self, problem: Problem, levels: Sequence[Sequence[float]]) -> None:
        super().__init__(problem)
        self.levels = [tuple(each) for each in levels]
        self.size = 1
        for each in self.levels:
            self.size *= len(each)
        self._known: dict[Combination, Rank] = {}
        self._asked: list[Combination] = []
        self._left = problem.budget
        self._random = problem.random(self.name)
        self._stages = self.plan()
        self._stage = ""

    @abstractmethod
    def plan(self) -> Iterator[Stage]:
        """The stages; a generator, so that later ones can start from the best so far."""

    def ask(self) -> FloatArray:
        """Combinations that were not tried yet, (k, n)."""
        self._asked = []
        if self._left > 0:
            for stage, wanted in self._stages:
                new = [each for each in dict.fromkeys(wanted) if each not in self._known]
                if new:
                    self._stage, self._asked = stage, new[: self._left]
                    self._left -= len(self._asked)
                    break
        return np.array(
            [
                [levels[k] for levels, k in zip(self.levels, combination, strict=True)]
                for combination in self._asked
            ]
        ).reshape(-1, self.space.size)

    def tell(self, vectors: FloatArray, outcomes: Sequence[Outcome]) -> None:
        """Remember what each combination gave; failed ones count least."""
        for key, outcome in zip(self._asked, outcomes, strict=True):
            rank = rank_of(outcome, self.problem.objectives[0])
            self._known[key] = FAILED if outcome.failed else rank

    def describe(self) -> dict[str, Any]:
        """The present stage by the key "stage"."""
        return {"stage": self._stage}

    def everything(self, stage: str) -> Iterator[Stage]:
        """All combinations; the last parameter changes fastest."""
        everyone = product(*(range(len(each)) for each in self.levels))
        while chunk := list(islice(everyone, GENERATION)):
            yield stage, chunk

    def climb(
        self, stage: str, movable: Sequence[Sequence[int]], start: Combination | None = None
    ) -> Iterator[Stage]:
        """Change one set of parameters that move together, take the best change, until none helps.

        Args:
            stage: what it is called.
            movable: sets of parameters; those of a set have the same levels.
            start: where to begin; the best so far if None.
        """
        here = start if start is not None else self.best()
        yield stage, [here]
        while True:
            near = [
                changed(here, members, level)
                for members in movable
                for level in range(len(self.levels[members[0]]))
                if level != here[members[0]]
            ]
            yield stage, near
            best = max(near, key=lambda each: self._known.get(each, FAILED))
            if self._known.get(best, FAILED) <= self._known.get(here, FAILED):
                return
            here = best

    def climb_again(self, stage: str, movable: Sequence[Sequence[int]]) -> Iterator[Stage]:
        """Climb from places near the best, until the budget is spent or all is known."""
        if self.size <= self.problem.budget:
            yield from self.everything(stage)
            return
        while True:
            yield from self.climb(stage, movable, self._shaken(self.best()))

    def best(self) -> Combination:
        """The best combination so far; the one nearest to the design before there is one."""
        if self._known:
            return max(self._known, key=lambda each: self._known[each])
        return tuple(
            int(np.abs(np.array(levels) - now).argmin())
            for levels, now in zip(self.levels, self.space.start, strict=True)
        )

    def _shaken(self, combination: Combination) -> Combination:
        """Two parameters or more changed at random."""
        count = len(combination)
        most = int(self._random.integers(min(2, count), count + 1))
        shaken = list(combination)
        for place in self._random.choice(count, size=most, replace=False).tolist():
            shaken[place] = int(self._random.integers(len(self.levels[place])))
        return tuple(shaken)


def changed(combination: Combination, members: Sequence[int], level: int) -> Combination:
    """A combination with some parameters at another level."""
    other = list(combination)
    for member in members:
        other[member] = level
    return tuple(other)


def levels_of(space: BoundSpace) -> list[tuple[float, ...]]:
    """The values of each parameter.

    Raises:
        SearchError: a parameter has no steps.
    """
    found = []
    for parameter in space.parameters:
        levels = parameter.kind.levels
        if levels is None:
            raise SearchError(
                "the number of steps is needed",
                where=parameter.name,
                hint=f"Write {parameter.asked}=LOW:HIGH:STEPS",
            )
        found.append(levels)
    return found
