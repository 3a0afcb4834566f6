"""Sensitivity analysis: the share of each error in the variance of a score.

The measure is the total-effect index of Homma and Saltelli ("Importance measures in global
sensitivity analysis of nonlinear models", 1996): the share of the score's variance that remains, on
average, if one source of error varies and all others are fixed, including its interactions with
them. It is estimated by Jansen's formula ("Analysis of variance designs for model output", 1999;
formula (f) of table 2 in Saltelli et al., "Variance based sensitivity analysis of model output",
2010): half the mean squared difference between two sensors whose errors differ in that source
alone, divided by the variance. A source may comprise many numbers, such as the positions of all
lights.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from optisense.array_types import FloatArray
from optisense.search.evaluation.robust import percentile
from optisense.search.space.manufacturing import BoundManufacturingErrors, latin_hypercube

RESAMPLES = 1000
"""Number of bootstrap samples for an interval; with 1000 the ends of a 90 % interval are known to a
few per cent of its width.
"""

INTERVAL = (0.05, 0.95)
"""Ends of a 90 % interval, as quantiles of the bootstrap distribution."""

LEAST_PAIRS = 4
"""Smallest number of pairs of sensors for an estimate of a share of variance, with an interval."""


@dataclass(frozen=True)
class Estimate:
    """Number with its 90 % bootstrap interval.

    Attributes:
        value, low, high: the number and the ends of the interval. For a percentile, NaN stands for
            a failed sensor, which is below every score.
        error: standard error: the standard deviation of the bootstrap; NaN if the percentile is
            that of a failed sensor in any resample.
    """

    value: float
    low: float
    high: float
    error: float = 0.0


def paired_errors(bound: BoundManufacturingErrors, rows: int, seed: int) -> FloatArray:
    """Return errors (rows, 1 + sources, d): each row has a first sensor, and for each source
    another one that differs from it in the errors of this source alone.

    All sensors have the distribution of the errors. With a single source there is nothing to
    separate, and each row has one sensor.
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
    """Return a percentile of scores (rows, k), failed ones (NaN) lowest; NaN without rows."""
    values = np.asarray(scores, dtype=np.float64)
    if not values.size:
        return Estimate(np.nan, np.nan, np.nan)
    again = [percentile(values[rows].ravel(), share) for rows in _resampled(len(values))]
    return _estimate(percentile(values.ravel(), share), again)


def total_effect(scores: ArrayLike, source: int) -> Estimate | None:
    """Return the share of one source in the variance, with the standard error of the unclipped
    estimate, or None if too few pairs of scores (rows, 1 + sources) of the sensors of
    `paired_errors` are known; NaN where a sensor failed.
    """
    values = np.asarray(scores, dtype=np.float64)
    if values.shape[1] == 1:
        scored = values[np.isfinite(values)]
        whole = float((scored != scored[:1]).any())
        return Estimate(whole, whole, whole)
    known = np.isfinite(values[:, 0]) & np.isfinite(values[:, 1 + source])
    if known.sum() < LEAST_PAIRS:
        return None
    again = [_share(values[rows], source) for rows in _resampled(len(values))]
    found = _estimate(_share(values, source), again)
    # Jansen's formula can give 1.65 where a share is near 1 and sensors are few. The true share is
    # never above 1, so clipping brings every estimate nearer to the truth.
    value, low, high = (min(1.0, each) for each in (found.value, found.low, found.high))
    return Estimate(value, low, high, found.error)


def _share(values: FloatArray, source: int) -> float:
    """Return the unclipped share of one source in the variance of scores (rows, 1 + sources).
    Shares of a linear score are too large by 7 % of themselves with 8 rows and 1 % with 64, a
    seventh of their standard errors or less.
    """
    apart = values[:, 0] - values[:, 1 + source]
    apart = apart[np.isfinite(apart)]
    variance = float(np.var(values[np.isfinite(values)]))
    if not len(apart) or variance == 0.0:
        return 0.0
    return float(0.5 * np.mean(apart**2) / variance)


def _resampled(rows: int) -> NDArray[np.int64]:
    """Return rows drawn with replacement, (RESAMPLES, rows); the same ones each time."""
    return np.random.default_rng(rows).integers(rows, size=(RESAMPLES, rows))


def _estimate(value: float, again: list[float]) -> Estimate:
    low, high = (percentile(again, share) for share in INTERVAL)
    return Estimate(value, low, high, float(np.std(again)))
