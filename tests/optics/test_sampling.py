"""Numbers that camera samples draw."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np

from optisense.optics.backend.sequences import RICHTMYER_STEPS, in_series

SAMPLES = 64
SERIES = 500


def test_elements_of_a_series_are_spread_evenly_and_series_are_independent() -> None:
    lane = dr.arange(mi.UInt32, SERIES * SAMPLES)
    for dimension in range(len(RICHTMYER_STEPS)):
        values = np.asarray(in_series(lane // SAMPLES, lane % SAMPLES, dimension))
        sets = values.reshape(SERIES, SAMPLES).astype(np.float64)
        assert sets.min() >= 0.0 and sets.max() < 1.0
        ordered = np.sort(sets, axis=1)
        gaps = np.diff(np.concatenate([ordered, ordered[:, :1] + 1.0], axis=1), axis=1)
        assert gaps.max() < 3.0 / SAMPLES
        # The mean of evenly spread numbers is as exact as that of 16 times as many random ones.
        assert sets.mean(axis=1).std() < np.sqrt(1 / 12 / SAMPLES / 16)
        # First elements are shifts by random bits: as many in each tenth, to 5 sigma.
        counts = np.histogram(sets[:, 0], bins=10, range=(0.0, 1.0))[0]
        assert np.abs(counts - SERIES / 10).max() < 5 * np.sqrt(SERIES * 0.1 * 0.9)


def test_dimensions_of_a_series_do_not_follow_each_other() -> None:
    lane = dr.arange(mi.UInt32, 20_000)
    columns = np.stack(
        [np.asarray(in_series(lane, lane * 0, k)) for k in range(len(RICHTMYER_STEPS))]
    )
    off = np.abs(np.corrcoef(columns)) - np.eye(len(RICHTMYER_STEPS))
    assert off.max() < 5 / np.sqrt(20_000)
