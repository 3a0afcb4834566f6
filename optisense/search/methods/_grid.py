"""Search method "grid": all combinations of the steps and options of all parameters."""

from __future__ import annotations

import math
from collections.abc import Iterator

from optisense.errors import SearchError
from optisense.search.methods._combinations import Combinations, Stage, levels_of
from optisense.search.methods.base import Problem
from optisense.search.space.search_space import BoundSpace


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
