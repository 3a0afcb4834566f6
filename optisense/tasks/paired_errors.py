"""Comparison of the errors of two sensors on the same presses by paired t-intervals."""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np
from scipy.special import stdtrit

from optisense.array_types import FloatArray

CONFIDENCE = 95.0
"""Confidence level (per cent) of the interval, the usual one."""

LEAST_OBJECTS = 6
"""Smallest number of objects for a verdict. If changes are not distributed normally, only their
signs count: for two equal sensors, those of 6 objects agree once in 32 times, which is below the 5
per cent of the interval."""

BETTER, WORSE, INCONCLUSIVE = "better", "worse", "inconclusive"


@dataclass(frozen=True)
class ErrorChange:
    """The difference of an error between two sensors that the same objects press.

    Attributes:
        before, after: mean errors of the first and of the second sensor.
        low, high: the ends of the 95 % confidence interval of after - before.
        objects: number of objects, which determines the width of the interval.
    """

    before: float
    after: float
    low: float
    high: float
    objects: int

    @property
    def change(self) -> float:
        """The change of the error, after - before; below 0 the second sensor is better."""
        return self.after - self.before

    @property
    def verdict(self) -> str:
        """The verdict on the second sensor: BETTER, WORSE or INCONCLUSIVE."""
        if self.objects < LEAST_OBJECTS:
            return INCONCLUSIVE
        if self.high < 0.0:
            return BETTER
        return WORSE if self.low > 0.0 else INCONCLUSIVE

    @property
    def ends(self) -> tuple[float, float] | None:
        """The ends of the interval; None for one object, as only the differences between objects
        tell them.
        """
        return None if self.objects < 2 else (self.low, self.high)

    def interval(self, digits: int) -> str:
        """Return the interval with a number of digits after the point, as text, or "unknown"."""
        if self.ends is None:
            return "unknown"
        low, high = self.ends
        return f"{low:+.{digits}f} to {high:+.{digits}f}"

    def to_dict(self) -> dict[str, float | str | int | None]:
        """Return all values, ready for JSON; an unknown interval has the ends None."""
        low, high = self.ends or (None, None)
        return {
            **asdict(self),
            "low": low,
            "high": high,
            "change": self.change,
            "confidence": CONFIDENCE,
            "verdict": self.verdict,
        }


def error_change(before: FloatArray, after: FloatArray) -> ErrorChange:
    """Compare the errors of two sensors on the same presses.

    The standard error of the change has three parts: the changes of the objects, whose spread
    includes that of their places, and the readers of either sensor, which are independent. As
    these are few, Student's t widens the interval; its degrees of freedom follow from the parts by
    Welch and Satterthwaite (Welch, "The generalization of 'Student's' problem when several
    different population variances are involved", Biometrika 34, 1947).

    Args:
        before, after: (objects, places, readers) errors of both sensors on the same presses.
    """
    if before.shape[:2] != after.shape[:2]:
        raise ValueError(f"errors of other presses: {before.shape} and {after.shape}")
    change = after.mean() - before.mean()
    values = [
        after.mean(axis=(1, 2)) - before.mean(axis=(1, 2)),
        *(errors.mean(axis=(0, 1)) for errors in (before, after)),
    ]
    parts = [(v.var(ddof=1) / len(v), len(v) - 1) for v in values if len(v) > 1]
    variance = sum(part for part, _ in parts)
    half = 0.0
    if variance > 0.0:
        freedom = variance**2 / sum(part**2 / free for part, free in parts)
        half = float(stdtrit(freedom, 0.5 + CONFIDENCE / 200.0) * np.sqrt(variance))
    return ErrorChange(
        before=float(before.mean()),
        after=float(after.mean()),
        low=float(change - half),
        high=float(change + half),
        objects=len(before),
    )
