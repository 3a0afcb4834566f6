"""Cross-validated forests: what they read well, what they can't, and that none cheats."""

from __future__ import annotations

import numpy as np
import pytest

from optisense.errors import TaskError
from optisense.tasks._regression import read_by_forest


def test_a_smooth_target_is_read_far_better_than_guessed() -> None:
    rng = np.random.default_rng(1)
    x = rng.uniform(-1, 1, (300, 2))
    reading = read_by_forest(x, np.column_stack([x[:, 0] + x[:, 1], x[:, 0] - x[:, 1]]))
    # The mean distance of the sum of two uniform numbers from its mean is 2 / 3.
    assert reading.guess == pytest.approx(2 / 3, rel=0.05)
    assert reading.error < 0.2 * reading.guess
    assert 0 < reading.spread < reading.error


def test_no_sample_is_read_by_a_forest_that_saw_it() -> None:
    rng = np.random.default_rng(2)
    # Forests fitted to these would tell their own samples far below guessing.
    reading = read_by_forest(rng.normal(size=(150, 3)), rng.normal(size=(150, 1)))
    assert reading.error > 0.9 * reading.guess


def test_the_same_seed_gives_the_same_reading() -> None:
    rng = np.random.default_rng(3)
    x, y = rng.normal(size=(40, 3)), rng.normal(size=(40, 1))
    first, again, other = (read_by_forest(x, y, seed) for seed in (0, 0, 1))
    assert np.array_equal(first.predictions, again.predictions)
    assert not np.array_equal(first.predictions, other.predictions)


def test_too_few_samples_are_refused() -> None:
    with pytest.raises(TaskError, match="too few"):
        read_by_forest(np.zeros((9, 1)), np.zeros((9, 1)))
