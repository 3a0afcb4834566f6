"""Sensitivity analysis: the share of each error in the variance of a score.

The measure is the total-effect index of Homma and Saltelli ("Importance measures in global
sensitivity analysis of nonlinear models", 1996): the part of the score's variance that is left, on
average, while one source of error varies and all others are held, its interactions with them
included. It is estimated by Jansen's formula ("Analysis of variance designs for model output",
1999; formula (f) of table 2 in Saltelli et al., "Variance based sensitivity analysis of model
output", 2010): half the mean squared difference between two sensors whose errors differ in that
source alone, over the variance. A source may be many numbers, such as the places of all lights.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from optisense.search.evaluation.robust import percentile
from optisense.search.space.manufacturing import BoundManufacturingErrors, latin_hypercube

FloatArray = NDArray[np.float64]

RESAMPLES = 1000
"""Number of bootstrap samples behind an interval; the ends of an interval of 90 % are known to a
few per cent of its width."""

INTERVAL = (0.05, 0.95)
"""Ends of an interval, as parts of the bootstrap's distribution."""

LEAST_PAIRS = 4
"""Number of pairs of sensors that a share of variance must rest on; no interval can be told from
fewer."""


@dataclass(frozen=True)
class Estimate:
    """A number with the interval that holds it in nine of ten cases (bootstrap).

    Attributes:
        value, low, high: the number and the ends of the interval.
        error: its standard error: the standard deviation of the bootstrap.
    """

    value: float
    low: float
    high: float
    error: float = 0.0


def paired_errors(bound: BoundManufacturingErrors, rows: int, seed: int) -> FloatArray:
    """(rows, 1 + sources, d) errors: in each row a first sensor, and for each source another one
    that differs from it in the errors of this source alone.

    All of them are distributed as the errors are. With a single source there is nothing to tell
    apart, and each row holds one sensor.
    """
    sources = len(bound.sources)
    shares = latin_hypercube(rows, 2 * bound.size, seed)
    one = bound.errors(shares[:, : bound.size])
    if sources == 1:
        return one[:, None]
    other = bound.errors(shares[:, bound.size :])
    found = np.repeat(one[:, None], 1 + sources, axis=1)
    for number in range(sources):
        own = bound.owner == number
        found[:, 1 + number, own] = other[:, own]
    return found


def percentile_of(scores: ArrayLike, share: float) -> Estimate:
    """A percentile of scores (rows, k), failed ones (NaN) below all others; NaN without any row."""
    values = np.asarray(scores, dtype=np.float64)
    if not values.size:
        return Estimate(np.nan, np.nan, np.nan)
    again = [percentile(values[rows].ravel(), share) for rows in _resampled(len(values))]
    return _estimate(percentile(values.ravel(), share), again)


def total_effect(scores: ArrayLike, source: int) -> Estimate | None:
    """The share of one source in the variance; None where too few pairs have scores.

    Args:
        scores: (rows, 1 + sources) of the sensors of `paired_errors`, NaN where one failed.
        source: its number.

    Returns:
        The share, at most 1, with the standard error of the estimate before it was cut there.
    """
    values = np.asarray(scores, dtype=np.float64)
    if values.shape[1] == 1:
        return Estimate(1.0, 1.0, 1.0)
    known = np.isfinite(values[:, 0]) & np.isfinite(values[:, 1 + source])
    if known.sum() < LEAST_PAIRS:
        return None
    again = [_share(values[rows], source) for rows in _resampled(len(values))]
    return _within_bounds(_estimate(_share(values, source), again))


def _within_bounds(share: Estimate) -> Estimate:
    """A share without what chance adds above 1.

    The formula is unbiased and so can give 1.65 where a share is near 1 and sensors are few. The
    true share is never above 1, so cutting there brings each estimate, and each end of an
    interval, nearer to it or leaves it. The standard error is that of the estimate before.
    """
    value, low, high = (min(1.0, each) for each in (share.value, share.low, share.high))
    return Estimate(value, low, high, share.error)


def _share(values: FloatArray, source: int) -> float:
    apart = values[:, 0] - values[:, 1 + source]
    apart = apart[np.isfinite(apart)]
    variance = float(np.var(values[np.isfinite(values)]))
    if not len(apart) or variance == 0.0:
        return 0.0
    return float(0.5 * np.mean(apart**2) / variance)


def _resampled(rows: int) -> NDArray[np.int64]:
    """(RESAMPLES, rows): rows drawn with replacement; the same ones each time."""
    return np.random.default_rng(rows).integers(rows, size=(RESAMPLES, rows))


def _estimate(value: float, again: list[float]) -> Estimate:
    known = [each for each in again if np.isfinite(each)]
    if not known or not np.isfinite(value):
        return Estimate(value, np.nan, np.nan, np.nan)
    low, high = np.quantile(known, INTERVAL).tolist()
    return Estimate(value, low, high, float(np.std(known)))
