"""Means over seeds, their standard deviations, and comparisons by t tests."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from optisense.objectives.score import deviation_of
from paper.unit import Record

CONFIDENCE = 0.95
"""Confidence from which on two values count as different (one-sided t test), the usual choice."""

Spread = dict[str, Any]
"""Dict of mean, standard_deviation (None for one value) and values (None if a seed gave none)."""


def spread(values: Sequence[float | None]) -> Spread:
    """Return mean and sample standard deviation over seeds; seeds without a value are left out."""
    there = [float(value) for value in values if value is not None and math.isfinite(value)]
    return {
        "mean": float(np.mean(there)) if there else None,
        "standard_deviation": deviation_of(there) if len(there) > 1 else None,
        "values": [None if v is None or not math.isfinite(v) else float(v) for v in values],
    }


def spread_of(objective: str, records: Iterable[Record]) -> Spread:
    """Return mean and standard deviation of the scores of an objective, see `spread`."""
    return spread([record.score(objective) for record in records])


def shown(found: Spread, digits: int = 3) -> str:
    """Return a text such as ``0.951 ± 0.003``; ``none`` if there is no value."""
    if found["mean"] is None:
        return "none"
    text = number(found["mean"], digits)
    deviation = found["standard_deviation"]
    return text if deviation is None else f"{text} ± {number(deviation, 2)}"


def number(value: float | None, digits: int = 3) -> str:
    """Return a number with so many significant digits, never in powers of ten."""
    if value is None or not math.isfinite(value):
        return "none"
    if value == 0.0:
        return "0"
    places = max(0, digits - 1 - math.floor(math.log10(abs(value))))
    return f"{value:.{places}f}"


def is_larger(one: Spread, other: Spread) -> bool | None:
    """Return whether one mean is larger than another, by a t test of the differences of each seed.

    The result is None if the difference is not significant. With a single seed, the two values are
    compared, and None is returned if they are equal.
    """
    pairs = zip(one["values"], other["values"], strict=True)
    differences = np.array([a - b for a, b in pairs if a is not None and b is not None])
    if not len(differences):
        return None
    mean = float(differences.mean())
    if len(differences) == 1 or np.ptp(differences) == 0.0:
        return None if mean == 0.0 else mean > 0.0
    error = float(differences.std(ddof=1)) / math.sqrt(len(differences))
    if abs(mean) <= quantile(len(differences) - 1) * error:
        return None
    return mean > 0.0


def exceeds(found: Spread, limit: float) -> bool | None:
    """Return whether a mean is larger than a number, by the test of `is_larger`."""
    return is_larger(found, spread([limit] * len(found["values"])))


def by_seed(numbers: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return dicts of spreads, nested to any depth, once for each seed with its values alone."""
    parts: dict[str, list[Any]] = {
        name: [spread([value]) for value in each["values"]] if "values" in each else by_seed(each)
        for name, each in numbers.items()
    }
    return [dict(zip(parts, row, strict=True)) for row in zip(*parts.values(), strict=True)]


def best(values: Mapping[str, Spread]) -> tuple[str | None, list[str]]:
    """Return the name with the largest mean, and all names that do not differ significantly."""
    there = {name: each for name, each in values.items() if each["mean"] is not None}
    if not there:
        return None, []
    top = max(there, key=lambda name: there[name]["mean"])
    alike = [name for name in there if name == top or not is_larger(there[top], there[name])]
    return top, alike


def best_satisfies(alike: Sequence[str], satisfies: Callable[[str], bool]) -> bool | None:
    """Return whether the best of several variants satisfies a condition, from those that may be it.

    The result is True only if all of them satisfy it, False only if none does, and otherwise None.

    Args:
        alike: names of the best variant and of those that do not differ significantly from it, as
            from `best`; the result is None if there are none.
        satisfies: function of a name.
    """
    found = {satisfies(name) for name in alike}
    return found.pop() if len(found) == 1 else None


def spearman(first: Sequence[float], second: Sequence[float]) -> tuple[float, float]:
    """Return Spearman's rank correlation and its one-sided p-value, by all permutations.

    Both are NaN if there are fewer than three pairs, or if all values are equal. The p-value is
    exact; its cost grows with the factorial of the number of pairs, which should be at most nine.
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


def quantile(freedom: int) -> float:
    """Return the quantile of the t distribution at `CONFIDENCE`, for these degrees of freedom."""
    from scipy.stats import t

    return float(t.ppf(CONFIDENCE, freedom))
