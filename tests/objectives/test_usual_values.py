"""The values by which front ends show how good a score is are those of the built-in sensors."""

from __future__ import annotations

import pytest

import optisense as ots
from optisense.objectives.registry import find, names

BY_RAYS = ("aoap", "2to3pw", "coverage", "distortion")
ENDS = ("gelsight-svelte", "gelsight360", "gelbelt", "gelsight-mini-ideal-spherical")
"""The built-in sensors among which the poorest and the best of each objective are."""


def test_poor_and_good_are_the_ends_of_the_built_in_sensors() -> None:
    found = {each: ots.evaluate(ots.load(each), BY_RAYS) for each in ENDS}
    for name in BY_RAYS:
        objective = find(name)
        assert objective.usual is not None
        sign = -1.0 if objective.lower_is_better else 1.0
        values = sorted(sign * scores[name].value for scores in found.values())
        poor, good = (sign * value for value in objective.usual)
        assert values[0] == pytest.approx(poor, rel=0.03), name
        assert values[-1] == pytest.approx(good, rel=0.03), name


def test_what_is_usual_lies_in_the_range_and_in_its_order() -> None:
    for name in names():
        objective = find(name)
        low, high = objective.bounds()
        if objective.usual is not None:
            poor, good = objective.usual
            assert (poor > good) == objective.lower_is_better
            assert low <= min(poor, good) < max(poor, good) <= high
