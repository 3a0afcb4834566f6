"""The interval of a difference: known cases, and how often it is wrong where nothing differs."""

from __future__ import annotations

import numpy as np
import pytest

from optisense.tasks.paired_errors import BETTER, INCONCLUSIVE, WORSE, error_change


def test_a_constant_difference_is_told_exactly() -> None:
    before = np.random.default_rng(0).uniform(5.0, 20.0, (8, 3, 1))
    found = error_change(before, before - 2.0)
    assert (found.low, found.high) == pytest.approx((-2.0, -2.0))
    assert found.change == pytest.approx(-2.0)
    assert found.verdict == BETTER
    assert error_change(before - 2.0, before).verdict == WORSE


def test_equal_errors_tell_nothing() -> None:
    errors = np.random.default_rng(1).uniform(5.0, 20.0, (8, 3, 2))
    found = error_change(errors, errors)
    assert found.low < 0.0 < found.high
    assert found.verdict == INCONCLUSIVE


def test_few_objects_tell_nothing_however_different() -> None:
    before = np.full((5, 9, 1), 20.0)
    assert error_change(before, before / 2).verdict == INCONCLUSIVE


def test_the_interval_of_one_object_is_unknown_also_in_files() -> None:
    before = np.random.default_rng(3).uniform(5.0, 20.0, (1, 4, 1))
    found = error_change(before, before - np.arange(4.0)[:, None])
    assert found.interval(1) == "unknown"
    assert found.to_dict()["low"] is None
    assert found.to_dict()["high"] is None


def test_the_luck_of_readers_widens_the_interval() -> None:
    errors = np.tile(np.linspace(5.0, 20.0, 8)[:, None, None], (1, 3, 3))
    lucky = errors + np.array([-1.0, 0.0, 1.0])
    assert error_change(errors, errors - 0.3).verdict == BETTER
    assert error_change(lucky, lucky - 0.3).verdict == INCONCLUSIVE


@pytest.mark.parametrize(
    ("objects", "places", "readers"), [(1.0, 0.0, 0.0), (1.0, 1.0, 0.3), (0.0, 0.1, 1.0)]
)
def test_it_is_seldom_wrong_where_nothing_differs(
    objects: float, places: float, readers: float
) -> None:
    rng = np.random.default_rng(2)
    wrong = 0
    for _ in range(1000):
        shifts = objects * rng.normal(size=(6, 1, 1)) + places * rng.normal(size=(6, 2, 1))
        before, after = readers * rng.normal(size=(2, 1, 1, 3)) + np.zeros((6, 2, 1))
        wrong += error_change(before, after + shifts).verdict != INCONCLUSIVE
    # 5 per cent by construction, with a standard error of 0.7 per cent.
    assert wrong <= 70


def test_other_presses_are_refused() -> None:
    with pytest.raises(ValueError, match="other presses"):
        error_change(np.zeros((6, 2, 1)), np.zeros((6, 3, 1)))
