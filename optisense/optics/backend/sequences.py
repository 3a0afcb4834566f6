"""Low-discrepancy points: a Kronecker sequence in fixed point, shifted by a seed.

The steps are the powers of 1/phi_4, phi_4 the root of x^5 = x + 1 (the generalised golden
ratio; Roberts 2018), so that every prefix of the sequence is spread evenly in four dimensions.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray


def _steps(dimensions: int) -> list[int]:
    root = 1.5
    for _ in range(64):
        root = (1 + root) ** (1 / (dimensions + 1))
    return [round((root ** -(k + 1)) * 2**32) & 0xFFFFFFFF for k in range(dimensions)]


STEPS = _steps(4)
"""Steps of the four-dimensional sequence, in units of 2^-32: the powers of the generalised golden
ratio, see the module's docstring."""
STEPS_2D = _steps(2)
"""Steps of the two-dimensional sequence (R2 of Roberts 2018), in units of 2^-32."""
RICHTMYER_STEPS = [round((prime**0.5 % 1) * 2**32) for prime in (2, 3, 5, 7)]
"""Fractional parts of the square roots of primes (Richtmyer's sequence), in units of 2^-32. They
are not close to simple fractions, so that a few elements are spread evenly in each single dimension
as well; the first of `STEPS` is nearly 6/7."""
GOLDEN_BITS = 0x9E3779B9
"""Multiplier (2^32 over the golden ratio) that gives the members of a list different bits. Its
multiples modulo 2^32 are far apart (Knuth's multiplicative hashing)."""
HASH_ROUNDS = 8
"""Number of rounds of the hash that shifts a Richtmyer sequence. With the usual four, similar bits
give similar shifts."""


def unit_float(bits: mi.UInt32) -> mi.Float:
    """Return a number (n,) in [0, 1) from the upper 24 of 32 random bits (n,)."""
    return mi.Float(bits >> 8) * 2**-24


def baker_transform(value: mi.Float) -> mi.Float:
    """Return the baker's transformation 1 - abs(2 x - 1) (n,) of numbers x (n,) in [0, 1).

    It folds the interval about its middle, by which functions on it become periodic.
    """
    return 1 - dr.abs(2 * value - 1)


def next_random(state: mi.UInt32) -> mi.UInt32:
    """Return the next state (n,) of a linear congruential generator (PCG, O'Neill 2014)."""
    return state * 747796405 + 2891336453


def sequence_4d(index: mi.UInt32, stream: mi.UInt32, seed: mi.UInt32) -> tuple[mi.Float, ...]:
    """Return four coordinates (n,) in [0, 1) of an element of a four-dimensional sequence.

    Args:
        index: number (n,) of the element.
        stream: number (n,) of the sequence.
        seed: seed of the sequences' shifts.
    """
    return _element(STEPS, index, stream, seed)


def sequence_2d(index: mi.UInt32, stream: mi.UInt32, seed: mi.UInt32) -> mi.Point2f:
    """Return a point of the unit square of a two-dimensional sequence; see `sequence_4d`."""
    return mi.Point2f(*_element(STEPS_2D, index, stream, seed))


def _element(
    steps: Sequence[int], index: mi.UInt32, stream: mi.UInt32, seed: mi.UInt32
) -> tuple[mi.Float, ...]:
    shifts = (mi.sample_tea_32(stream * 4 + k, seed)[0] for k in range(len(steps)))
    return tuple(
        unit_float(index * mi.UInt32(step) + shift)
        for step, shift in zip(steps, shifts, strict=True)
    )


@lru_cache(maxsize=4)
def lattice_multipliers(most: int) -> NDArray[np.uint32]:
    """Return the multipliers (most + 1,) of the rank-1 lattices of 0 to ``most`` points.

    Point i of the lattice of n points with multiplier a is (i / n, i a / n), modulo 1. Of all
    multipliers without a common divisor with n, the one whose points are farthest apart is chosen.
    """
    out = np.ones(most + 1, dtype=np.uint32)
    for n in range(3, most + 1):
        steps = np.arange(1, n)
        candidates = steps[np.gcd(steps, n) == 1]
        away = steps * candidates[:, None] % n
        squares = np.minimum(steps, n - steps) ** 2 + np.minimum(away, n - away) ** 2
        out[n] = candidates[squares.min(axis=1).argmax()]
    return out


def folded_lattice(
    index: mi.UInt32, count: mi.UInt32, most: int, stream: mi.UInt32, seed: mi.UInt32
) -> mi.Point2f:
    """Return points of the unit square from a lattice of ``count`` points that is shifted by random
    numbers and folded.

    The fold (the baker's transformation, 1 - abs(2 x - 1)) makes the mean of a smooth function over
    all points of a lattice converge as 1 / ``count``^2 (Hickernell 2002).

    Args:
        index: number of the point.
        count: number of points of its lattice, at least 1.
        most: upper bound on ``count``.
        stream: number of the shift.
        seed: seed of the shifts.
    """
    multiplier = dr.gather(mi.UInt32, mi.UInt32(lattice_multipliers(most)), count)
    out = []
    # `index % count` would divide whole numbers by 0 in the lanes beyond the arrays' end.
    share = 1 / mi.Float(count)
    for k, place in enumerate((index, index * multiplier)):
        shift = unit_float(mi.sample_tea_32(stream * 4 + k, seed)[0])
        value = mi.Float(place) * share + shift
        out.append(baker_transform(value - dr.floor(value)))
    return mi.Point2f(*out)


def richtmyer(series: mi.UInt32, number: mi.UInt32, dimension: int) -> mi.Float:
    """Return one coordinate (n,) in [0, 1) of an element of a shifted Richtmyer sequence.

    Args:
        series: random bits (n,) that shift the sequence.
        number: number (n,) of the element.
        dimension: index of the coordinate in `RICHTMYER_STEPS`.
    """
    shift = mi.sample_tea_32(series, mi.UInt32(dimension), HASH_ROUNDS)[0]
    return unit_float(number * mi.UInt32(RICHTMYER_STEPS[dimension]) + shift)


def seed_of(*numbers: int) -> int:
    """Hash several numbers into one 32-bit seed."""
    return int(np.random.SeedSequence([n & 0xFFFFFFFF for n in numbers]).generate_state(1)[0])
