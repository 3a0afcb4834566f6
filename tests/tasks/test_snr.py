"""The signal-to-noise ratio against variances known beforehand."""

from __future__ import annotations

import numpy as np
import pytest

from optisense.errors import TaskError
from optisense.tasks._snr import signal_to_noise

COUNT = 20_000


def test_noise_on_a_smooth_target_gives_one_plus_the_ratio_of_variances() -> None:
    rng = np.random.default_rng(1)
    x = rng.uniform(0, 1, COUNT)
    noise = 0.1
    y = 3 * x + rng.normal(0, noise, COUNT)
    # The variance of 3 x for x uniform over 0..1 is 9 / 12; the ratio spreads by 2 %.
    assert signal_to_noise(x, y) == pytest.approx(1 + 9 / 12 / noise**2, rel=0.06)


@pytest.mark.parametrize("neighbours", [2, 5, 20])
def test_the_number_of_neighbours_does_not_bias_it(neighbours: int) -> None:
    rng = np.random.default_rng(2)
    x = rng.uniform(0, 1, COUNT)
    y = np.sin(2 * np.pi * x) + rng.normal(0, 0.2, COUNT)
    assert signal_to_noise(x, y, neighbours) == pytest.approx(1 + 0.5 / 0.04, rel=0.05)


def test_features_that_tell_nothing_give_one() -> None:
    rng = np.random.default_rng(3)
    assert signal_to_noise(rng.normal(size=(COUNT, 3)), rng.normal(size=COUNT)) == pytest.approx(
        1, abs=0.03
    )


def test_targets_add_up_their_variances() -> None:
    rng = np.random.default_rng(4)
    x = rng.uniform(-1, 1, (COUNT, 2))
    y = x + rng.normal(0, [0.1, 0.3], (COUNT, 2))
    whole, noise = 2 / 3 + 0.01 + 0.09, 0.01 + 0.09
    assert signal_to_noise(x, y) == pytest.approx(whole / noise, rel=0.05)


def test_it_does_not_depend_on_the_units() -> None:
    rng = np.random.default_rng(5)
    x, y = rng.normal(size=(300, 3)), rng.normal(size=(300, 2))
    assert signal_to_noise(100 * x, 7 * y + 3) == pytest.approx(signal_to_noise(x, y))


def test_neighbours_that_agree_exactly_give_infinity() -> None:
    x = np.repeat([0.0, 1.0], 10)
    assert signal_to_noise(x, x, 3) == np.inf


@pytest.mark.parametrize(
    ("features", "targets", "neighbours"),
    [
        (np.zeros(4), np.zeros(4), 4),
        (np.zeros(4), np.zeros(5), 2),
        (np.zeros(4), np.zeros(4), 1),
        (np.array([0, np.nan, 1, 2]), np.zeros(4), 2),
    ],
)
def test_what_has_no_answer_is_refused(
    features: np.ndarray, targets: np.ndarray, neighbours: int
) -> None:
    with pytest.raises(TaskError):
        signal_to_noise(features, targets, neighbours)
