"""Rounding of the powers of photons: it keeps their mean, and sums do not depend on their order."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from optisense import OpticalModel
from optisense.design import set_value
from optisense.optics.radiance_cache._power_rounding import (
    LEAST_QUANTA,
    QUANTA_PER_PHOTON,
    PowerRounding,
)
from optisense.sensors import build

PHOTONS = 300_000
PIXELS = (40, 30)
POWER = 3.7e-6
"""Power (mW) of a photon as it is emitted."""


@pytest.mark.parametrize("weight", [1e-5, 0.02, 1.0, 50.0])
def test_rounding_keeps_the_mean_power(weight: float) -> None:
    """Of photons weaker than a quantum, too."""
    count = 1_000_000
    rounding = PowerRounding.of(POWER, mi.sample_tea_32(dr.arange(mi.UInt32, count), mi.UInt32(7)))
    power = dr.full(mi.Float, weight * POWER, count)
    rounded = np.array(rounding(power * rounding.kept(power))).astype(float)
    quantum = float(rounding.quantum[0])
    assert POWER / QUANTA_PER_PHOTON / 2 < quantum <= POWER / QUANTA_PER_PHOTON
    least = LEAST_QUANTA * quantum
    kept = min(1.0, weight * POWER / least)
    noise = np.sqrt((1.0 - kept) / kept / count)
    assert rounded.mean() == pytest.approx(weight * POWER, rel=1e-5 + 4 * noise)
    assert np.abs(rounded[rounded > 0] - max(weight * POWER, least)).max() <= 1.01 * quantum


def test_the_cache_of_a_seed_is_always_the_same() -> None:
    """Threads add photons in another order each time, and a coating scatters them many times."""
    design = set_value(build("gelsight-mini-ideal"), "coating.specularity", 0.3)
    tallies = []
    for _ in range(2):
        model = OpticalModel(design, "llvm")
        model.render((), PIXELS, photons=PHOTONS)
        (tally,) = model._store._running.values()
        tallies.append([np.array(table) for table in (*tally.landed, tally.halves)])
    assert all(table.any() for table in tallies[0][:2])
    for one, two in zip(*tallies, strict=True):
        np.testing.assert_array_equal(one, two)
