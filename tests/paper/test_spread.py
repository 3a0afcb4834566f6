"""Standard deviations, and comparisons with their uncertainty."""

from __future__ import annotations

import math

import numpy as np
import pytest

from paper.spread import (
    best,
    best_satisfies,
    by_seed,
    exceeds,
    is_larger,
    number,
    shown,
    spearman,
    spread,
)


def test_mean_and_deviation_of_a_sample() -> None:
    found = spread([1.0, 2.0, 3.0, None, math.nan])
    assert found["mean"] == 2.0
    assert found["standard_deviation"] == 1.0
    assert found["values"] == [1.0, 2.0, 3.0, None, None]
    assert spread([None]) == {"mean": None, "standard_deviation": None, "values": [None]}
    assert spread([4.0])["standard_deviation"] is None


def test_differences_seed_by_seed_tell_more_than_means() -> None:
    one, other = spread([1.0, 2.0, 3.0]), spread([1.1, 2.1, 3.11])
    assert is_larger(other, one) is True
    assert is_larger(one, other) is False


def test_what_seeds_scatter_by_is_no_difference() -> None:
    rng = np.random.default_rng(0)
    wrong = 0
    for _ in range(400):  # two sensors that are alike
        a, b = rng.normal(size=(2, 4))
        wrong += is_larger(spread(list(a)), spread(list(b))) is not None
    assert 0.05 < wrong / 400 < 0.15  # each side 5 %


def test_one_seed_is_compared_plainly_and_gaps_are_left_out() -> None:
    assert is_larger(spread([2.0]), spread([1.0])) is True
    assert is_larger(spread([1.0]), spread([1.0])) is None
    assert is_larger(spread([None, 2.0]), spread([5.0, 1.0])) is True
    assert is_larger(spread([None]), spread([1.0])) is None


def test_a_limit_within_the_scatter_is_neither_exceeded_nor_kept() -> None:
    found = spread([0.34, 0.525, 0.64])
    assert [exceeds(found, limit) for limit in (0.1, 0.45, 0.9)] == [True, None, False]


def test_numbers_of_each_seed_alone() -> None:
    numbers = {"a": spread([1.0, None]), "b": {"c": spread([3.0, 4.0])}}
    assert by_seed(numbers) == [
        {"a": spread([1.0]), "b": {"c": spread([3.0])}},
        {"a": spread([None]), "b": {"c": spread([4.0])}},
    ]


def test_best_names_all_that_cannot_be_told_from_it() -> None:
    columns = {
        "a": spread([1.0, 1.1, 0.9]),
        "b": spread([1.0, 0.9, 1.2]),
        "c": spread([0.1, 0.2, 0.1]),
        "d": spread([None, None, None]),
    }
    top, alike = best(columns)
    assert top == "b"
    assert alike == ["a", "b"]
    assert best({"d": columns["d"]}) == (None, [])


def test_the_best_satisfies_what_all_that_may_be_it_satisfy() -> None:
    assert best_satisfies(["0", "0.2"], lambda value: float(value) < 0.3) is True
    assert best_satisfies(["0.4", "0.6"], lambda value: float(value) < 0.3) is False
    assert best_satisfies(["0", "0.4"], lambda value: float(value) < 0.3) is None
    assert best_satisfies([], lambda value: True) is None


def test_spearman_and_its_chance() -> None:
    assert spearman([1, 2, 3, 4], [10, 20, 30, 40]) == (pytest.approx(1.0), pytest.approx(1 / 24))
    assert spearman([1, 2, 3], [3, 2, 1])[0] == pytest.approx(-1.0)
    assert math.isnan(spearman([1, 2], [1, 2])[0])
    assert math.isnan(spearman([1, 1, 1], [1, 2, 3])[0])


def test_numbers_have_the_digits_that_count() -> None:
    assert number(0.95123) == "0.951"
    assert number(-69.461) == "-69.5"
    assert number(1234.5) == "1234" or number(1234.5) == "1235"
    assert number(None) == "none"
    assert shown(spread([0.951, 0.953, 0.949])) == "0.951 ± 0.0020"
    assert shown(spread([None])) == "none"
