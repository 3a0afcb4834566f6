"""Contract tests of search methods, for those of this package and of other packages.

Use them in a test file for pytest::

    from optisense.search.testing import MethodContract

    class TestMine(MethodContract):
        method = "mine"

Each test runs whole studies in memory, on functions of the design that need no image.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from functools import cache, lru_cache
from typing import Any

import numpy as np
import pytest

from optisense.array_types import FloatArray
from optisense.design import SensorDesign, get_value
from optisense.errors import SearchError
from optisense.search._run_search import run_study
from optisense.search.evaluation.evaluator import Goal
from optisense.search.space.parameters import Choice
from optisense.search.space.search_space import BoundSpace, SearchSpace
from optisense.search.study.best import tied
from optisense.search.study.plan import Plan
from optisense.search.study.progress import SearchResult
from optisense.search.study.study import Study

Landscape = Callable[[FloatArray], float]
"""Score of a point (n,), whose coordinates are shares of their ranges, 0 to 1."""

LANDSCAPES: dict[str, Landscape] = {
    "a hill": lambda share: -float(((share - 0.3) ** 2).sum()),
    "best at the lower bounds": lambda share: -float(share.sum()),
    "best at the upper bounds": lambda share: float(share.sum()),
    "flat": lambda share: 0.25,
    "a few steps, so that many tie": lambda share: float(np.floor(3.0 * share).max()),
    "a quarter of it is NaN": lambda share: float(share[0]) if share[0] < 0.75 else math.nan,
    "a quarter of it is infinite": lambda share: float(share[0]) if share[0] < 0.75 else math.inf,
    "very large numbers": lambda share: 1e300 * float(share.sum()),
}
"""Scores with shapes that are difficult for search methods: a maximum inside the space or at a
bound, ties, missing and infinite scores, and numbers near the largest float64.
"""

MOST_PARAMETERS = 50
"""Largest number of parameters of spaces that are searched by all scores; larger ones are searched
by one score only, since the others would test nothing new.
"""


@cache
def gelsight_mini() -> SensorDesign:
    """Return the design that the studies start from."""
    from optisense.sensors import load

    return load("gelsight-mini-ideal")


def general_spaces() -> dict[str, dict[str, object]]:
    """Return spaces of every size and kind; numbers have steps, so that grids can search them."""
    design = gelsight_mini()
    lights = [
        f"lights.{group}.lights[{index}].{what}.{axis}"
        for group in design.lights
        for index in range(len(design.lights[group].lights))
        for what in ("position", "direction")
        for axis in "xyz"
    ]
    others = [f"camera.position.{axis}" for axis in "xyz"]
    others += [f"coating.{what}.{channel}" for what in ("eta", "k") for channel in "rgb"]
    others += ["camera.fov"]
    # The lights stand beside the light guide, and none may be moved into it.
    hundred = {
        path: (get_value(design, path), 0.1 if ".position." in path else 0.4)
        for path in [*lights, *others]
    }
    colour = ["red", "green", "blue"]
    return {
        "one number": {"camera.fov": (40.0, 60.0, 7)},
        "two numbers": {"coating.specularity": (0.0, 1.0, 3), "camera.position.x": (-1.0, 3.0, 5)},
        "100 numbers": {
            path: (float(now) - half, float(now) + half) for path, (now, half) in hundred.items()
        },
        "one whole number": {"camera.resolution[0]": (318, 322)},
        "one choice": {"lights.red.colour": colour},
        "whole numbers and choices": {
            "camera.resolution[0]": (318, 322),
            "lights.red.colour": colour,
            "lights.blue.colour": colour,
        },
        "a number, a whole number and a choice": {
            "coating.specularity": (0.0, 1.0, 3),
            "camera.resolution[0]": (318, 322),
            "lights.red.colour": colour,
        },
    }


class MethodContract:
    """Contract of search methods; a subclass names the method.

    Attributes:
        method: name of the method.
        options: options of the method for the tests.
        budget: number of trials of each study.
        objectives: number of objectives that the method needs.
        optimum_tolerance: largest distance of the best trial from the optimum of one or two
            numbers, as a share of the range; None if the method promises nothing.
        rerun_tolerance: largest difference between two runs of one study, as a share of the ranges
            and scores; above 0 only if trials themselves differ in their last digits.
    """

    method: str
    options: Mapping[str, Any] = {}
    budget: int = 18
    objectives: int = 1
    optimum_tolerance: float | None = None
    rerun_tolerance: float = 0.0

    def design(self) -> SensorDesign:
        """Return the design that the studies start from."""
        return gelsight_mini()

    def spaces(self) -> dict[str, dict[str, object]]:
        """Return the spaces to search, by a name for messages."""
        return general_spaces()

    def landscapes(self) -> dict[str, str | Landscape]:
        """Return the scores to maximise, by a name for messages; a text is an objective's name."""
        return dict(LANDSCAPES)

    def settings(self) -> dict[str, Any]:
        """Return the settings of the objectives, if the landscapes are objectives."""
        return {}

    def coordinates(self, space: BoundSpace, design: SensorDesign) -> FloatArray:
        """Return the point (n,) of a space that a design was made from, read from the design."""
        found = []
        for parameter in space.parameters:
            target = parameter.targets[0]
            value = get_value(design, target.path)
            if isinstance(parameter.kind, Choice):
                options = [_plain(option) for option in parameter.kind.options]
                found.append(float(options.index(_plain(value))))
            else:
                found.append((float(value) - target.offset) / target.scale)
        return np.array(found)

    def study(
        self, space: Mapping[str, object], goal: str | Landscape, budget: int, seed: int = 0
    ) -> Study:
        """Return a new study in memory.

        Raises:
            SearchError: the method refuses the space.
        """
        design = self.design()
        goals: list[Goal] = []
        for number in range(self.objectives):
            goals.append(goal if isinstance(goal, str) else self._function(space, goal, number))
        plan = Plan(
            space=SearchSpace(space),
            goals=goals,
            method=self.method,
            options=dict(self.options),
            budget=budget,
            seed=seed,
            settings=self.settings(),
        )
        return Study.create(None, design, plan)

    def cases(self) -> Iterator[tuple[str, Mapping[str, object], str | Landscape]]:
        """Yield each space with each landscape, and a name for messages."""
        for space_name, space in self.spaces().items():
            for number, (name, goal) in enumerate(self.landscapes().items()):
                if number and len(space) > MOST_PARAMETERS:
                    break
                yield f"{space_name}, {name}", space, goal

    def run(
        self, space: Mapping[str, object], goal: str | Landscape, budget: int | None = None
    ) -> SearchResult:
        """Return the result of a whole study."""
        return run_study(self.study(space, goal, budget or self.budget))

    def result_of(self, case: str) -> SearchResult:
        """Return the result of a case of `cases`, run once for all tests that only read it."""
        return _whole(type(self), case)  # type: ignore[arg-type]  # classes can be hashed

    def test_it_searches_every_space_by_every_score(self) -> None:
        """Every study ends normally, with valid points, and names the highest-scored trial."""
        for case, _, _ in self.cases():
            result = self.result_of(case)
            assert result.ended in ("the budget is spent", "the method has finished"), case
            new = [trial for trial in result.trials if not trial.is_start]
            assert 1 <= len(new) <= self.budget, case
            for trial in new:
                result.study.space.check(trial.vector)
            scores = [trial.score for trial in result.trials if math.isfinite(trial.score)]
            assert result.best.score == max(scores), case

    def test_a_budget_of_one_is_one_trial(self) -> None:
        """A budget of one scores the start and one more point."""
        goal = next(iter(self.landscapes().values()))
        for name, space in self.spaces().items():
            result = self.run(space, goal, 1)
            assert len(result.trials) == 2, name  # the start is not counted

    def test_a_study_that_was_stopped_goes_on_as_if_it_had_not_been(self) -> None:
        """A study that is stopped twice and resumed has the trials of an uninterrupted one."""
        for case, space, goal in self.cases():
            if case.endswith(("bounds", "large numbers", "infinite")):
                continue  # the other landscapes test the same property
            whole = self.result_of(case)
            study = self.study(space, goal, self.budget)
            for limit in (self.budget // 8 + 1, self.budget // 2, self.budget):
                parts = run_study(study, limit=limit)
            _same(parts, whole, self.rerun_tolerance, case)
            assert parts.notes == whole.notes, case

    def test_ties_are_told_and_the_start_wins_those_that_it_shares(self) -> None:
        """Where all scores are equal, the start is the best, and a note reports the tie."""
        if self.objectives > 1 or "flat" not in self.landscapes():
            return  # several objectives have a front and no best trial
        for name, space in self.spaces().items():
            result = self.run(space, self.landscapes()["flat"])
            assert result.best.is_start, name
            same = tied(result.trials)
            assert len(same) == len({trial.vector.tobytes() for trial in result.trials}), name
            if len(same) > 1:
                assert any("have the same score" in note for note in result.notes), name

    def test_where_all_trials_fail_the_reason_is_told(self) -> None:
        """A search in which every trial fails raises an error with the reason."""
        if not all(callable(goal) for goal in self.landscapes().values()):
            return  # objectives of the package fail where their own tests say

        def broken(share: FloatArray) -> float:
            raise ValueError("no such sensor can be made")

        for space in self.spaces().values():
            with pytest.raises(SearchError, match="no such sensor can be made"):
                self.run(space, broken)

    def test_failed_trials_cost_nothing_else(self) -> None:
        """If all trials but the start fail, the start is the best trial."""
        if not all(callable(goal) for goal in self.landscapes().values()):
            return

        def only_start(share: FloatArray) -> float:
            return 1.0 if (share == start).all() else math.nan

        for name, space in self.spaces().items():
            bound = SearchSpace(space).bind(self.design(), tried=False)
            start = bound.to_unit(bound.start)
            if self.objectives == 1:
                assert self.run(space, only_start).best.is_start, name

    def test_it_finds_the_best_of_one_and_two_numbers(self) -> None:
        """The best trial is within `optimum_tolerance` of an optimum at the bounds."""
        if self.optimum_tolerance is None:
            return
        for case, space, goal in self.cases():
            if not case.startswith(("one number", "two numbers")) or "best at" not in case:
                continue
            best = self.run(space, goal, 4 * self.budget).best
            share = best.space.to_unit(best.vector)
            wanted = 1.0 if "upper" in case else 0.0
            assert np.abs(share - wanted).max() <= self.optimum_tolerance, case

    def _function(
        self, space: Mapping[str, object], landscape: Landscape, number: int
    ) -> Callable[[SensorDesign], float]:
        """Return a goal for a landscape; the second is highest where the first is lowest."""
        bound = SearchSpace(space).bind(self.design(), tried=False)  # a study tries the bounds

        def score(design: SensorDesign) -> float:
            share = bound.to_unit(self.coordinates(bound, design))
            return landscape(np.clip(1.0 - share if number else share, 0.0, 1.0))

        score.__name__ = f"score_{number}"
        return score


@lru_cache(maxsize=64)
def _whole(contract: type[MethodContract], case: str) -> SearchResult:
    tested = contract()
    space, goal = next(found[1:] for found in tested.cases() if found[0] == case)
    return tested.run(space, goal)


def _same(one: SearchResult, other: SearchResult, rounding: float, case: str) -> None:
    """Check that two results have the same trials, to the last bit if `rounding` is 0."""
    pairs = list(zip(one.trials, other.trials, strict=True))
    for first, second in pairs:
        assert (first.number, first.generation) == (second.number, second.generation), case
        assert first.failure == second.failure, case
        share = one.study.space.to_unit(np.stack([first.vector, second.vector]))
        np.testing.assert_allclose(share[0], share[1], rtol=0.0, atol=rounding, err_msg=case)
        old, new = (np.array(list(trial.scores.values())) for trial in (first, second))
        np.testing.assert_allclose(old, new, rtol=rounding, atol=rounding, err_msg=case)


def _plain(value: object) -> object:
    return tuple(value) if isinstance(value, list | tuple) else value
