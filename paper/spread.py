"""Means over seeds, how sure they are, and comparisons that know it."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from optisense.objectives.score import deviation_of

SURE = 0.95
"""Confidence at which two values count as different (one-sided t test)."""

Spread = dict[str, Any]
"""mean, standard_deviation (None for one value), values (None where a seed gave none)."""


def spread(values: Sequence[float | None]) -> Spread:
    """Mean and standard deviation (of a sample) over seeds; seeds without a value are left out."""
    there = [float(value) for value in values if value is not None and math.isfinite(value)]
    return {
        "mean": float(np.mean(there)) if there else None,
        "standard_deviation": deviation_of(there) if len(there) > 1 else None,
        "values": [None if v is None or not math.isfinite(v) else float(v) for v in values],
    }


def shown(found: Spread, digits: int = 3) -> str:
    """Such as ``0.951 ± 0.003``; ``none`` where there is no value."""
    if found["mean"] is None:
        return "none"
    text = number(found["mean"], digits)
    deviation = found["standard_deviation"]
    return text if deviation is None else f"{text} ± {number(deviation, 2)}"


def number(value: float | None, digits: int = 3) -> str:
    """A number with so many digits that count, never in powers of ten."""
    if value is None or not math.isfinite(value):
        return "none"
    if value == 0.0:
        return "0"
    places = max(0, digits - 1 - math.floor(math.log10(abs(value))))
    return f"{value:.{places}f}"


def is_larger(one: Spread, other: Spread) -> bool | None:
    """Whether one mean is larger than another, by the differences seed by seed.

    None where the seeds can't tell. With a single seed the plain comparison counts, and equal
    values can't be told apart.
    """
    pairs = zip(one["values"], other["values"], strict=True)
    differences = np.array([a - b for a, b in pairs if a is not None and b is not None])
    if not len(differences):
        return None
    mean = float(differences.mean())
    if len(differences) == 1 or np.ptp(differences) == 0.0:
        return None if mean == 0.0 else mean > 0.0
    error = float(differences.std(ddof=1)) / math.sqrt(len(differences))
    if abs(mean) <= _quantile(len(differences) - 1) * error:
        return None
    return mean > 0.0


def best(values: Mapping[str, Spread]) -> tuple[str | None, list[str]]:
    """The name with the largest mean, and all names that the seeds can't tell from it."""
    there = {name: each for name, each in values.items() if each["mean"] is not None}
    if not there:
        return None, []
    top = max(there, key=lambda name: there[name]["mean"])
    alike = [name for name in there if name == top or not is_larger(there[top], there[name])]
    return top, alike


def spearman(first: Sequence[float], second: Sequence[float]) -> tuple[float, float]:
    """The rank correlation, and the share of all orders of `second` that reach it or more.

    NaN where there are fewer than three pairs or all are alike. The share is exact, so it grows
    with the factorial of their number; nine at most are meant.
    """
    from scipy.stats import rankdata

    a, b = rankdata(first), rankdata(second)
    if len(a) < 3 or not (np.isfinite([*first, *second]).all() and np.ptp(a) and np.ptp(b)):
        return float("nan"), float("nan")
    a, b = (ranks - ranks.mean() for ranks in (a, b))
    scale = np.sqrt((a**2).sum() * (b**2).sum())
    orders = np.array(list(itertools.permutations(b)))
    reached = float(a @ b / scale)
    return reached, float((orders @ a / scale >= reached - 1e-9).mean())


def _quantile(freedom: int) -> float:
    from scipy.stats import t

    return float(t.ppf(SURE, freedom))
