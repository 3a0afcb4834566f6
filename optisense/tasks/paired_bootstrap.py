"""Comparison of the errors of two sensors on the same presses by a paired bootstrap."""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np

from optisense.array_types import FloatArray

RESAMPLES = 4000
"""Number of resamples; the ends of the interval then vary by 2 to 3 per cent of its width."""

CONFIDENCE = 95.0
"""Confidence level (per cent) of the interval, the usual one."""

LEAST_OBJECTS = 6
"""Smallest number of objects for a verdict. For two equal sensors, the changes of all of 5 objects
have the same sign once in 16 times, and of 6 objects once in 32, which is below the 5 per cent of
the interval."""

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


def error_change(before: FloatArray, after: FloatArray, seed: int = 0) -> ErrorChange:
    """Compare the errors of two sensors on the same presses.

    The bootstrap has two stages: objects are drawn with replacement, then places of each object
    (Davison and Hinkley, "Bootstrap Methods and their Application", 1997, section 3.8). Readers are
    drawn separately for each sensor, as they are independent.

    Args:
        before, after: (objects, places, readers) errors of both sensors on the same presses.
    """
    if before.shape[:2] != after.shape[:2]:
        raise ValueError(f"errors of other presses: {before.shape} and {after.shape}")
    objects, places = before.shape[:2]
    rng = np.random.default_rng(seed)
    some = rng.integers(objects, size=(RESAMPLES, objects, 1))
    where = rng.integers(places, size=(RESAMPLES, objects, places))
    means = []
    for errors in (before, after):
        reader = rng.integers(errors.shape[2], size=(RESAMPLES, errors.shape[2]))
        drawn = errors[some[..., None], where[..., None], reader[:, None, None, :]]
        means.append(drawn.mean(axis=(1, 2, 3)))
    ends = np.percentile(means[1] - means[0], [50 - CONFIDENCE / 2, 50 + CONFIDENCE / 2])
    return ErrorChange(
        before=float(before.mean()),
        after=float(after.mean()),
        low=float(ends[0]),
        high=float(ends[1]),
        objects=objects,
    )
