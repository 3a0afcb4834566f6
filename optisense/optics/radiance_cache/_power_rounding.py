"""Rounding of the powers of photons, which makes their sums independent of the order of threads.

A sum of single-precision numbers depends on the order of its terms, and threads add photons in no
fixed order. Differences in the last digit would decide now and then which places of an image get
further samples. The powers are therefore rounded to whole quanta before they are added, so that the
sums are exact (Demmel and Nguyen 2013, "Fast reproducible floating-point summation").
"""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np

from optisense.optics.backend.sequences import unit_float

QUANTA_PER_PHOTON = 8192
"""Number of quanta of power in a photon as it is emitted. Single precision adds up to 2^24 quanta
exactly, the light of 2,048 such photons in one direction bin of a cell; the brightest bin of
GelSight Mini holds 0.17 of this with 5 million photons. The power of a photon changes by less than
0.01 %."""
LEAST_QUANTA = 32
"""Number of quanta below which photons are kept at random, with this power. Fewer quanta would not
represent the direction of a photon: the largest error of a component is one quantum."""


@dataclass
class PowerRounding:
    """Rounding to whole quanta, up or down at random, so that no light is lost on average.

    Attributes:
        quantum: the power of a quantum, mW; a power of two.
        per_quantum: its inverse.
        chances: two random numbers in [0, 1) for each photon.
    """

    quantum: mi.Float
    per_quantum: mi.Float
    chances: tuple[mi.Float, mi.Float]

    @classmethod
    def of(cls, emitted_power: float, random: tuple[mi.UInt32, mi.UInt32]) -> PowerRounding:
        """Return the rounding of photons.

        Args:
            emitted_power: mean power (mW) of the photons as they are emitted.
            random: random bits of each photon.
        """
        quantum = 2.0 ** np.floor(np.log2(emitted_power / QUANTA_PER_PHOTON))
        one, other = random
        chances = unit_float(one * 69069 + other), unit_float(other * 69069 + one)
        return cls(dr.opaque(mi.Float, quantum), dr.opaque(mi.Float, 1 / quantum), chances)

    def kept(self, power: mi.Float) -> mi.Float:
        """Return factors (n,) of powers, mW, by which weak photons grow or vanish."""
        least = LEAST_QUANTA * self.quantum
        survives = self.chances[1] * least < power
        return dr.select(power < least, dr.select(survives, least / power, 0), 1)

    def __call__(self, power: mi.Float) -> mi.Float:
        """Return powers (n,), mW, rounded to whole quanta."""
        return dr.floor(power * self.per_quantum + self.chances[0]) * self.quantum
