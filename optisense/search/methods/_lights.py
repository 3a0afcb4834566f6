"""Searches over the lights of a sensor: colours and powers of groups, and types of lights.

Light adds up: with a layer for each light group, an image under any colours and powers is a
weighted sum, with no new rendering. So all 6,561 ways to make eight groups red, green or blue are
scored in the time of a few hundred renderings, each exactly as by a rendering of its own.

Types vary as in the OptiSense paper (section "Light source"): one for all lights, one for each
group, or one for each light. The first two have few combinations, which are usually all tried. The
third has (number of types) to the power of (number of lights), so the budget decides how many are
tried: one light after another is changed, starting from the best of the other kinds.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from itertools import product

from optisense.errors import SearchError
from optisense.search.evaluation.evaluator import DesignEvaluator, Evaluator
from optisense.search.evaluation.relit import RelitEvaluator
from optisense.search.methods._combinations import (
    Combinations,
    Stage,
    chunks,
    levels_of,
)
from optisense.search.methods.base import Problem
from optisense.search.space.design_variables import LightType
from optisense.search.space.parameters import Choice
from optisense.search.space.search_space import BoundSpace

MOST_COLOURINGS = 20_000
"""Largest number of colourings that are tried where no budget is given: enough for all 6,561 ways
to make eight groups red, green or blue.
"""

GROUPWISE_SHARE = 0.5
"""Largest share of the budget that the combinations by group may take to be all tried; the rest is
left for single lights.
"""

MOST_TYPE_TRIALS = 400
"""Largest number of trials where no budget is given: each one traces its light anew."""

FOR_ALL, FOR_GROUPS, FOR_LIGHTS = "one type for all", "one type a group", "one type a light"


class LightColours(Combinations):
    """Search over all colourings if the budget allows it, else over one group after another.

    It works for spaces of colours and powers only: `lights.GROUP.colour=R,G,B` and
    `lights.GROUP.flux=LOW:HIGH:STEPS`, of any groups.
    """

    name = "light-colours"
    summary = "colours and powers of light groups, thousands from one rendering"
    renders_once = True

    def __init__(self, problem: Problem) -> None:
        super().__init__(problem, _colour_levels(problem.space))

    @classmethod
    def default_budget(cls, space: BoundSpace) -> int:
        """Return the number of all colourings, up to a limit."""
        return min(math.prod(len(levels) for levels in _colour_levels(space)), MOST_COLOURINGS)

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


def _colour_levels(space: BoundSpace) -> list[tuple[float, ...]]:
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


class LightTypes(Combinations):
    """Search over one type for all, then all combinations by group, then light by light.

    It works for spaces of light types only: `lights.types` (every light by itself), or any number
    of `lights.GROUP.lights[INDEX].model`, all with the same options.
    """

    name = "types"
    summary = "types of lights: one for all, one a group, then one a light"
    accepts_coarse_scores = True

    def __init__(self, problem: Problem) -> None:
        self._options = _options(problem.space)
        self._members = _groups(problem.space)
        super().__init__(problem, [range(self._options)] * problem.space.size)

    @classmethod
    def default_budget(cls, space: BoundSpace) -> int:
        """Return the number of combinations by group, and as many trials again for single lights,
        within limits.
        """
        options = _options(space)
        wanted = max(2 * options ** len(_groups(space)), 4 * space.size)
        return min(wanted, options**space.size, MOST_TYPE_TRIALS)

    def plan(self) -> Iterator[Stage]:
        """See `Combinations.plan`."""
        size = self.space.size
        yield FOR_ALL, [(option,) * size for option in range(self._options)]
        members = {number: k for k, each in enumerate(self._members) for number in each}
        owner = [members[number] for number in range(size)]
        if self._options ** len(self._members) <= max(
            GROUPWISE_SHARE * self.problem.budget, 2 * self._options
        ):
            for chunk in chunks(product(range(self._options), repeat=len(self._members))):
                yield FOR_GROUPS, [tuple(each[k] for k in owner) for each in chunk]
        else:
            yield from self.climb(FOR_GROUPS, self._members)
        singles = [[number] for number in range(size)]
        yield from self.climb(FOR_LIGHTS, singles)
        yield from self.climb_again(FOR_LIGHTS, singles)


def _groups(space: BoundSpace) -> list[list[int]]:
    """Return the indices of the parameters of each light group."""
    found: dict[str, list[int]] = {}
    for number, parameter in enumerate(space.parameters):
        if isinstance(parameter.variable, LightType):
            found.setdefault(parameter.variable.group, []).append(number)
    return list(found.values())


def _options(space: BoundSpace) -> int:
    """Return the number of types, which is the same for all lights; SearchError if a
    parameter is not the type of a light.
    """
    for parameter in space.parameters:
        if not isinstance(parameter.variable, LightType):
            raise SearchError(
                "this method searches types of lights and nothing else",
                where=parameter.name,
                hint="Write --vary lights.types=TYPE,TYPE",
            )
    kinds = {p.kind.options for p in space.parameters if isinstance(p.kind, Choice)}
    if len(kinds) != 1:
        raise SearchError("all lights must have the same types to choose from")
    return len(kinds.pop())
