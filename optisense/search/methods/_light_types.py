"""Search over light types: one for all lights, one for each group, or one for each light.

These are the three kinds of variation of the OptiSense paper (section "Light source"). The first
two have few combinations, which are usually all tried. The third has (number of types) to the power
of (number of lights), so the budget decides how many are tried: one light after another is changed,
starting from the best of the other kinds.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice, product

import numpy as np

from optisense.errors import SearchError
from optisense.search.methods._combinations import GENERATION, Combination, Combinations, Stage
from optisense.search.methods.base import Problem
from optisense.search.space.design_variables import LightType
from optisense.search.space.parameters import Choice
from optisense.search.space.search_space import BoundSpace

GROUPWISE_SHARE = 0.5
"""Largest share of the budget that the combinations by group may take to be all tried; the rest is
left for single lights.
"""

LARGEST_DEFAULT_BUDGET = 400
"""Largest number of trials where no budget is given: each one traces its light anew."""

FOR_ALL, FOR_GROUPS, FOR_LIGHTS = "one type for all", "one type a group", "one type a light"


class LightTypes(Combinations):
    """Search over one type for all, then all combinations by group, then light by light.

    It works for spaces of light types only: `lights.types` (every light by itself), or any number
    of `lights.GROUP.lights[INDEX].model`, all with the same options.
    """

    name = "types"
    summary = "types of lights: one for all, one a group, then one a light"
    accepts_coarse_scores = True

    def __init__(self, problem: Problem) -> None:
        count = _options(problem.space)
        self._members = _groups(problem.space)
        self._options = count
        super().__init__(problem, [range(count)] * problem.space.size)

    @classmethod
    def default_budget(cls, space: BoundSpace) -> int:
        """Return the number of combinations by group, and as many trials again for single lights,
        within limits.
        """
        options = _options(space)
        wanted = max(2 * options ** len(_groups(space)), 4 * space.size)
        return min(wanted, options**space.size, LARGEST_DEFAULT_BUDGET)

    def plan(self) -> Iterator[Stage]:
        """See `Combinations.plan`."""
        size = self.space.size
        yield FOR_ALL, [(option,) * size for option in range(self._options)]
        count = self._options ** len(self._members)
        if count <= max(GROUPWISE_SHARE * self.problem.budget, 2 * self._options):
            yield from self._by_group()
        else:
            yield from self.climb(FOR_GROUPS, self._members)
        singles = [[number] for number in range(size)]
        yield from self.climb(FOR_LIGHTS, singles)
        yield from self.climb_again(FOR_LIGHTS, singles)

    def _by_group(self) -> Iterator[Stage]:
        """Yield all combinations of one type per group."""
        chosen = product(range(self._options), repeat=len(self._members))
        while chunk := list(islice(chosen, GENERATION)):
            yield FOR_GROUPS, [self._spread(each) for each in chunk]

    def _spread(self, chosen: Combination) -> Combination:
        """Return the combination by lights for one type per group."""
        combination = np.zeros(self.space.size, dtype=np.int64)
        for members, option in zip(self._members, chosen, strict=True):
            combination[members] = option
        return tuple(combination.tolist())


def _groups(space: BoundSpace) -> list[list[int]]:
    """Return the indices of the parameters of each light group."""
    found: dict[str, list[int]] = {}
    for number, parameter in enumerate(space.parameters):
        if isinstance(parameter.variable, LightType):
            found.setdefault(parameter.variable.group, []).append(number)
    return list(found.values())


def _options(space: BoundSpace) -> int:
    """Return the number of types, which is the same for all lights; SearchError for other
    parameters.
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
