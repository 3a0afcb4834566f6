"""Search over colours and powers of light groups, each scored from the same images.

Light adds up: with a layer for each light group, an image under any colours and powers is a
weighted sum, with no new rendering. So all 6,561 ways to make eight groups red, green or blue are
scored in the time of a few hundred renderings, each exactly as by a rendering of its own.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator

from optisense.errors import SearchError
from optisense.search.evaluation.evaluator import DesignEvaluator, Evaluator
from optisense.search.evaluation.relit import RelitEvaluator
from optisense.search.methods._combinations import Combinations, Stage, levels_of
from optisense.search.methods.base import Problem
from optisense.search.space.search_space import BoundSpace

LARGEST_DEFAULT_BUDGET = 20_000
"""Largest number of colourings that are tried where no budget is given: enough for all 6,561 ways
to make eight groups red, green or blue.
"""


class LightColours(Combinations):
    """Search over all colourings if the budget allows it, else over one group after another.

    It works for spaces of colours and powers only: `lights.GROUP.colour=R,G,B` and
    `lights.GROUP.flux=LOW:HIGH:STEPS`, of any groups.
    """

    name = "light-colours"
    summary = "colours and powers of light groups, thousands from one rendering"
    renders_once = True

    def __init__(self, problem: Problem) -> None:
        super().__init__(problem, _levels(problem.space))

    @classmethod
    def default_budget(cls, space: BoundSpace) -> int:
        """Return the number of all colourings, up to a limit."""
        return min(math.prod(len(levels) for levels in _levels(space)), LARGEST_DEFAULT_BUDGET)

    def plan(self) -> Iterator[Stage]:
        """See `Combinations.plan`."""
        if self.size <= self.problem.budget:
            yield from self.everything("all colourings")
            return
        singles = [[number] for number in range(self.space.size)]
        yield from self.climb("one group after another", singles)
        yield from self.climb_again("one group after another", singles)

    def evaluator(self, usual: DesignEvaluator) -> Evaluator:
        """Return an evaluator that renders once per seed, and stores little of each score."""
        return RelitEvaluator(usual, brief=True)


def _levels(space: BoundSpace) -> list[tuple[float, ...]]:
    """Return the levels of each parameter; SearchError if one is no colour or power of a light
    group.
    """
    for parameter in space.parameters:
        paths = [target.path for target in parameter.targets]
        if not paths or not all(
            re.fullmatch(r"lights\.[^.\[\]]+\.(flux|colour(\.[rgb])?)", path) for path in paths
        ):
            raise SearchError(
                "this method searches colours and powers of light groups and nothing else",
                where=parameter.name,
                hint="Write --vary 'lights.*.colour=R,G,B' or lights.GROUP.flux=1:5:3",
            )
    return levels_of(space)
