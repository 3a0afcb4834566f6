"""Methods over combinations of a few levels: the grid, and the base of hill climbs."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Iterator, Sequence
from itertools import islice, product

import numpy as np

from optisense.array_types import FloatArray
from optisense.errors import SearchError
from optisense.search.evaluation.outcome import FAILED, Outcome, Rank, rank_of
from optisense.search.methods.base import Method, Problem
from optisense.search.space.search_space import BoundSpace

Combination = tuple[int, ...]
"""Index of a level for each parameter."""

GENERATION = 512
"""Number of combinations that are proposed together where the method needs no outcome in between;
enough to keep any pool of workers busy.
"""

Stage = tuple[str, list[Combination]]
"""Name of a stage, and the combinations that it tries."""


class Combinations(Method):
    """Base class of methods that try combinations of levels by a plan, each once.

    Attributes:
        levels: coordinates that each parameter may take.
        size: number of combinations.
        stage: name of the stage of the plan whose combinations were asked for last.
    """

    def __init__(self, problem: Problem, levels: Sequence[Sequence[float]]) -> None:
        super().__init__(problem)
        self.levels = [tuple(each) for each in levels]
        self.size = 1
        for each in self.levels:
            self.size *= len(each)
        self._known: dict[Combination, Rank] = {}
        self._asked: list[Combination] = []
        self._random = problem.random(self.name)
        self._stages = self.plan()
        self.stage = ""

    @abstractmethod
    def plan(self) -> Iterator[Stage]:
        """Yield the stages as a generator, so that later ones can start from the best so far."""

    def ask(self) -> FloatArray:
        """Return combinations that were not tried yet, (k, n)."""
        self._asked = []
        for stage, wanted in self._stages:
            new = [each for each in dict.fromkeys(wanted) if each not in self._known]
            if new:
                self.stage, self._asked = stage, new
                break
        return np.array(
            [
                [levels[k] for levels, k in zip(self.levels, combination, strict=True)]
                for combination in self._asked
            ]
        ).reshape(-1, self.space.size)

    def tell(self, vectors: FloatArray, outcomes: Sequence[Outcome]) -> None:
        """Store the rank of each combination of a generation (k, n); failed ones rank last."""
        for key, outcome in zip(self._asked, outcomes, strict=True):
            self._known[key] = rank_of(outcome, self.problem.objectives[0])

    def everything(self, stage: str) -> Iterator[Stage]:
        """Yield all combinations; the last parameter changes fastest."""
        for chunk in chunks(product(*(range(len(each)) for each in self.levels))):
            yield stage, chunk

    def climb(
        self, stage: str, movable: Sequence[Sequence[int]], start: Combination | None = None
    ) -> Iterator[Stage]:
        """Yield the stages of a hill climb from a combination, or from the best so far: all changes
        of one set of parameters that move together (and have the same levels) are tried, and the
        best is taken, until none is an improvement.
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
        """Climb from random changes of the best combination until half of all are known, and then
        try the others in turn, since random changes would find the last ones hardly ever. All are
        tried in turn if the budget allows it.
        """
        while self.size > self.problem.budget and 2 * len(self._known) < self.size:
            yield from self.climb(stage, movable, self._perturbed(self.best()))
        yield from self.everything(stage)

    def best(self) -> Combination:
        """Return the best combination so far; before there is one, that nearest to the design."""
        if self._known:
            return max(self._known, key=lambda each: self._known[each])
        return tuple(
            int(np.abs(np.array(levels) - now).argmin())
            for levels, now in zip(self.levels, self.space.start, strict=True)
        )

    def _perturbed(self, combination: Combination) -> Combination:
        """Return a combination with two or more parameters changed at random."""
        count = len(combination)
        most = int(self._random.integers(min(2, count), count + 1))
        shaken = list(combination)
        for place in self._random.choice(count, size=most, replace=False).tolist():
            shaken[place] = int(self._random.integers(len(self.levels[place])))
        return tuple(shaken)


class Grid(Combinations):
    """Search over all combinations; the last parameter changes fastest."""

    name = "grid"
    summary = "every combination of steps and options"
    accepts_coarse_scores = True

    def __init__(self, problem: Problem) -> None:
        super().__init__(problem, levels_of(problem.space))
        if problem.budget < self.size:
            raise SearchError(
                f"the grid has {self.size:,} designs, the budget is {problem.budget:,}",
                hint="Leave --budget out, take fewer steps, or use another method",
            )

    @classmethod
    def default_budget(cls, space: BoundSpace) -> int:
        """Return the number of all combinations."""
        return math.prod(len(levels) for levels in levels_of(space))

    def plan(self) -> Iterator[Stage]:
        """See `Combinations.plan`."""
        return self.everything("every combination")


def chunks(combinations: Iterator[Combination]) -> Iterator[list[Combination]]:
    """Yield combinations by `GENERATION`."""
    while chunk := list(islice(combinations, GENERATION)):
        yield chunk


def changed(combination: Combination, members: Sequence[int], level: int) -> Combination:
    """Return a copy of a combination with some parameters at another level."""
    other = list(combination)
    for member in members:
        other[member] = level
    return tuple(other)


def levels_of(space: BoundSpace) -> list[tuple[float, ...]]:
    """Return the levels of each parameter; SearchError if one has none."""
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
