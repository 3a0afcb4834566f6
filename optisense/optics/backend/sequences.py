"""Low-discrepancy points: a Kronecker sequence in fixed point, shifted by a seed.

The steps are the powers of 1/phi_4, phi_4 the root of x^5 = x + 1 (the generalised golden
ratio; Roberts 2018), so that every prefix of the sequence is spread evenly in four dimensions.
"""

from __future__ import annotations

import mitsuba as mi
import numpy as np


def _steps(dimensions: int) -> list[int]:
    root = 1.5
    for _ in range(64):
        root = (1 + root) ** (1 / (dimensions + 1))
    return [round((root ** -(k + 1)) * 2**32) & 0xFFFFFFFF for k in range(dimensions)]


STEPS = _steps(4)
"""Steps of the four-dimensional sequence, in units of 2^-32."""
STEPS_2D = _steps(2)
"""Steps of the two-dimensional sequence, in units of 2^-32."""
RICHTMYER_STEPS = [round((prime**0.5 % 1) * 2**32) for prime in (2, 3, 5, 7)]
"""Fractional parts of the square roots of primes (Richtmyer's sequence), in units of 2^-32. They
are not close to simple fractions, so that a few elements are spread evenly in each single dimension
as well; the first of `STEPS` is nearly 6/7."""
GOLDEN_BITS = 0x9E3779B9
"""Multiplier (2^32 over the golden ratio) that gives the members of a list bits of their own: its
multiples are far apart."""
HASH_ROUNDS = 8
"""Number of rounds of the hash that shifts a Richtmyer sequence. With the usual four, similar bits
give similar shifts."""


def unit_float(bits: mi.UInt32) -> mi.Float:
    """A number in [0, 1) from random bits."""
    return mi.Float(bits >> 8) * 2**-24


def next_random(state: mi.UInt32) -> mi.UInt32:
    """The next state of a linear congruential generator (the step of PCG)."""
    return state * 747796405 + 2891336453


def sequence_4d(index: mi.UInt32, stream: mi.UInt32, seed: mi.UInt32) -> tuple[mi.Float, ...]:
    """Four coordinates in [0, 1) of element ``index`` of the sequence numbered by ``stream``
    and ``seed``.
    """
    out = []
    for k, step in enumerate(STEPS):
        shift = mi.sample_tea_32(stream * 4 + k, seed)[0]
        out.append(unit_float(index * mi.UInt32(step) + shift))
    return tuple(out)


def sequence_2d(index: mi.UInt32, stream: mi.UInt32, seed: mi.UInt32) -> mi.Point2f:
    """A point of the unit square, element ``index`` of a sequence numbered by ``stream`` and
    ``seed``.
    """
    out = []
    for k, step in enumerate(STEPS_2D):
        shift = mi.sample_tea_32(stream * 4 + k, seed)[0]
        out.append(unit_float(index * mi.UInt32(step) + shift))
    return mi.Point2f(*out)


def in_series(series: mi.UInt32, number: mi.UInt32, dimension: int) -> mi.Float:
    """One coordinate (of `RICHTMYER_STEPS`) in [0, 1) of element ``number`` of a shifted sequence.

    Args:
        series: random bits that shift the sequence.
        number: number of the element.
        dimension: index of the coordinate.
    """
    shift = mi.sample_tea_32(series, mi.UInt32(dimension), HASH_ROUNDS)[0]
    return unit_float(number * mi.UInt32(RICHTMYER_STEPS[dimension]) + shift)


def seed_of(*numbers: int) -> int:
    """Hash several numbers into one 32-bit seed."""
    return int(np.random.SeedSequence([n & 0xFFFFFFFF for n in numbers]).generate_state(1)[0])
