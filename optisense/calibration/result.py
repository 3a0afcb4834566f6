"""Result of a fit of a design to photographs, and its numbers with their uncertainties."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np

from optisense.calibration._least_squares import Solution
from optisense.calibration.comparing import Comparison
from optisense.calibration.quantities import fits_all_powers
from optisense.calibration.quantity import FitQuantity
from optisense.calibration.realism import Realism
from optisense.design import SensorDesign

UNDETERMINED = 0.7
"""Ratio of uncertainty to plausible range from which on photographs are said not to determine a
number: they then carry about as much information as the plausible range itself (1 / sqrt(2)).
"""

TOLD_APART = 0.85
"""Correlation of two numbers from which on photographs are said not to distinguish them: the
uncertainty of each is then twice what it would be if the other were known."""

AS_WELL = 0.1
"""Relative change of the unexplained energy below which a fit counts as neither better nor worse;
a second seed of the light, and another choice of the presses held out, change it by about as much.
"""

BACKGROUND_AS_WELL = 1.0
"""Loss of the background's peak signal-to-noise ratio, dB, above which a fit predicts the untouched
sensor worse: a quarter more energy of the error, and far more than another seed changes."""

ADVICE = (
    "Keep the design that you had, fit fewer numbers, or take more photographs at other places."
)
"""Advice after a fit that predicts something worse."""


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


@dataclass(frozen=True)
class Calibration:
    """Design that was fitted to photographs.

    Attributes:
        design: fitted design.
        exposure: exposure at which its pictures are as bright as the photographs.
        numbers: fitted numbers.
        alike: pairs of numbers, in words, that photographs can't distinguish, and correlations.
        before, after: comparisons of the original and the fitted design with all photographs.
        held_out: names of the presses that the fit did not use.
        notes: doubtful findings, one sentence each.
    """

    design: SensorDesign
    exposure: float
    numbers: tuple[FittedNumber, ...]
    alike: tuple[tuple[str, str, float], ...]
    before: Comparison = field(repr=False)
    after: Comparison = field(repr=False)
    held_out: tuple[str, ...]
    notes: tuple[str, ...]

    def of_presses(self, found: Realism, *, held_out: bool) -> Realism:
        """Return the figures of the presses that were held out, or of those that were not."""
        presses = [p for p in found.presses if (p.name in self.held_out) == held_out]
        readings = [r for r in found.readings if (r.name in self.held_out) == held_out]
        return replace(found, presses=tuple(presses), readings=tuple(readings))

    def verdict(self) -> str:
        """Return whether the fitted design predicts presses that it has not seen, and whether it
        predicts the untouched sensor worse than before, in words.
        """
        if not self.held_out:
            return (
                "No press is held out, so that nothing shows whether the fitted design predicts "
                "other presses."
            )
        before, after = (
            self.of_presses(side.realism, held_out=True).median("unexplained")
            for side in (self.before, self.after)
        )
        shares = f"{after:.3f} of their energy is unexplained, {before:.3f} before"
        told = "The fitted design predicts the presses held out"
        ratios = [side.realism.background.ratio for side in (self.after, self.before)]
        untouched = "the untouched sensor worse: {:.1f} dB, {:.1f} before".format(*ratios)
        worse = ratios[0] < ratios[1] - BACKGROUND_AS_WELL
        if after > before + AS_WELL * before:
            return f"{told} worse: {shares}. {ADVICE}"
        if after < before - AS_WELL * before:
            return f"{told} better: {shares}" + (f"; but {untouched}." if worse else ".")
        told = f"{told} as well as before: {shares}"
        return f"{told}; but {untouched}. {ADVICE}" if worse else f"{told}."

    def as_data(self) -> dict[str, Any]:
        """Return all numbers and figures, ready for JSON."""
        return {
            "verdict": self.verdict(),
            "exposure": self.exposure,
            "numbers": [asdict(each) for each in self.numbers],
            "not_told_apart": [list(pair) for pair in self.alike],
            "held_out": list(self.held_out),
            "notes": list(self.notes),
            "photographs": {
                "background": self.after.photographs.fingerprint,
                **{press.name: press.fingerprint for press in self.after.photographs.presses},
            },
            "before": self.before.realism.as_data(),
            "after": self.after.realism.as_data(),
        }


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
