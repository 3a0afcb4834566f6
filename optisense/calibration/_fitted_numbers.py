"""Numbers of a design that were fitted to photographs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from optisense.calibration._solution import Solution
from optisense.calibration.quantities import fits_all_powers
from optisense.calibration.quantity import FitQuantity
from optisense.design import SensorDesign

UNDETERMINED = 0.7
"""Ratio of uncertainty to plausible range from which on photographs are said not to determine a
number: they then carry about as much information as the plausible range itself (1 / sqrt(2)).
"""

TOLD_APART = 0.85
"""Correlation of two numbers from which on photographs are said not to distinguish them: the
uncertainty of each is then twice what it would be if the other were known."""


@dataclass(frozen=True)
class FittedNumber:
    """Number of the design that was fitted.

    Attributes:
        path, words, unit: see `FitQuantity`.
        before: value before the fit; None if the design has no such number.
        after: value after the fit.
        uncertainty: standard deviation of the value.
        determined: whether the photographs constrain it more than its plausible range does.
    """

    path: str
    words: str
    unit: str
    before: float | None
    after: float
    uncertainty: float
    determined: bool

    @property
    def before_words(self) -> str:
        """Value before the fit, in words."""
        return "none" if self.before is None else f"{self.before:.4g}"


def with_known_total(
    chosen: Sequence[FitQuantity], solution: Solution, fitted: SensorDesign
) -> Solution:
    """Return a solution with the covariance of powers whose sum is kept, which it is if all powers
    are fitted.

    Photographs determine the ratios of powers only. If the sum is kept, the error of one power
    changes all others: a power that alone is uncertain makes them uncertain, too.
    """
    if not fits_all_powers(fitted, chosen):
        return solution
    total = sum(group.flux * len(group.lights) for group in fitted.lights.values())
    powers, shares = [], []
    for index, each in enumerate(chosen):
        if each.path.startswith("lights.") and each.path.endswith(".flux"):
            group = fitted.lights[each.path.split(".")[1]]
            powers.append(index)
            shares.append(group.flux * len(group.lights) / total if total > 0.0 else 0.0)
    ranges = np.array([chosen[index].plausible_range for index in powers])
    change = np.eye(len(chosen))
    # A step changes the logarithm of a power by its range, and that of the sum by its share of it.
    change[np.ix_(powers, powers)] -= np.outer(1.0 / ranges, np.array(shares) * ranges)
    return replace(solution, covariance=change @ solution.covariance @ change.T)


def fitted_numbers(
    chosen: Sequence[FitQuantity], solution: Solution, fitted: SensorDesign
) -> tuple[FittedNumber, ...]:
    """Return the fitted numbers, with the fluxes of the fitted design."""
    deviations = np.sqrt(np.maximum(np.diag(solution.covariance), 0.0))
    found = []
    for each, step, deviation in zip(chosen, solution.steps, deviations, strict=True):
        value = each.value(float(step))
        error = abs(each.slope(float(step))) * float(deviation)
        if each.path.startswith("lights.") and each.path.endswith(".flux"):
            group = each.path.split(".")[1]
            scale = fitted.lights[group].flux / value
            value, error = value * scale, error * scale
        found.append(
            FittedNumber(
                each.path, each.words, each.unit, None if each.guessed else each.start, value,
                error, bool(deviation < UNDETERMINED),
            )
        )  # fmt: skip
    return tuple(found)


def correlated_pairs(
    chosen: Sequence[FitQuantity], solution: Solution
) -> tuple[tuple[str, str, float], ...]:
    """Return pairs of numbers, in words, that photographs can't distinguish, with correlation."""
    deviations = np.sqrt(np.maximum(np.diag(solution.covariance), 1e-300))
    correlation = solution.covariance / np.outer(deviations, deviations)
    found = []
    for one in range(len(chosen)):
        for other in range(one):
            value = float(correlation[one, other])
            if abs(value) > TOLD_APART:
                found.append((chosen[other].words, chosen[one].words, round(value, 3)))
    return tuple(sorted(found, key=lambda pair: -abs(pair[2])))
