"""Numbers that camera samples draw."""

from __future__ import annotations

from math import erf

import drjit as dr
import mitsuba as mi
import numpy as np

from optisense.optics.backend.sequences import (
    RICHTMYER_STEPS,
    folded_lattice,
    lattice_multipliers,
    richtmyer,
    sequence_2d,
)

SAMPLES = 64
SERIES = 500


def test_elements_of_a_series_are_spread_evenly_and_series_are_independent() -> None:
    lane = dr.arange(mi.UInt32, SERIES * SAMPLES)
    for dimension in range(len(RICHTMYER_STEPS)):
        values = np.asarray(richtmyer(lane // SAMPLES, lane % SAMPLES, dimension))
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
        [np.asarray(richtmyer(lane, lane * 0, k)) for k in range(len(RICHTMYER_STEPS))]
    )
    off = np.abs(np.corrcoef(columns)) - np.eye(len(RICHTMYER_STEPS))
    assert off.max() < 5 / np.sqrt(20_000)


def test_points_of_a_lattice_are_apart_in_each_direction() -> None:
    for count, multiplier in enumerate(lattice_multipliers(64)):
        points = np.arange(count) * int(multiplier) % max(count, 1)
        assert len(set(points)) == count
    assert lattice_multipliers(64)[5] in (2, 3)  # a square grid, turned
    assert lattice_multipliers(64)[8] in (3, 5)


def test_means_over_a_folded_lattice_are_more_exact_than_over_a_sequence() -> None:
    """Of a smooth function on the unit square that is not periodic."""
    count, sets = 12, 2_000
    lane = dr.arange(mi.UInt32, count * sets)
    number, stream, seed = lane % count, lane // count, mi.UInt32(5)

    def spread_of_means(place: mi.Point2f) -> float:
        x, y = np.asarray(place.x), np.asarray(place.y)
        assert min(x.min(), y.min()) >= 0 and max(x.max(), y.max()) <= 1
        means = np.exp(-((x - 0.8) ** 2) - (y - 0.1) ** 2).reshape(sets, count).mean(axis=1)
        assert abs(means.mean() - EXACT) < 4 * means.std() / np.sqrt(sets) + 1e-5
        return float(means.std())

    lattice = folded_lattice(number, dr.full(mi.UInt32, count, count * sets), 64, stream, seed)
    assert spread_of_means(lattice) < 0.3 * spread_of_means(sequence_2d(number, stream, seed))


EXACT = float(np.prod([np.pi**0.5 / 2 * (erf(1 - a) + erf(a)) for a in (0.8, 0.1)]))
"""Mean of exp(-(x - 0.8)^2 - (y - 0.1)^2) over the unit square."""
