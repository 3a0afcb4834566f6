"""Result of a fit of a design to photographs."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field, replace
from typing import Any

from optisense.calibration._fitted_numbers import FittedNumber
from optisense.calibration.comparing import Comparison
from optisense.calibration.realism import Realism
from optisense.design import SensorDesign

AS_WELL = 0.1
"""Relative change of the unexplained energy below which a fit counts as neither better nor worse;
a second seed of the light, and another choice of the presses held out, change it by about as much.
"""

BACKGROUND_AS_WELL = 1.0
"""Loss of the background's peak signal-to-noise ratio, dB, above which a fit predicts the untouched
sensor worse: a quarter more energy of the error. Another seed of the light changes it by some
tenths.
"""
ADVICE = (
    "Keep the design that you had, fit fewer numbers, or take more photographs at other places."
)
"""Advice after a fit that predicts something worse."""


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
