"""Whether one sensor reads better than another on the same presses, by a paired bootstrap."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

RESAMPLES = 4000
"""Number of resamples; the ends of the interval then vary by 2 to 3 per cent of its width."""

CONFIDENCE = 95.0
"""Per cent of the resamples that the interval holds, as is usual."""

LEAST_OBJECTS = 6
"""Objects without which nothing is told: if two sensors are alike, all of 5 objects come out on one
side once in 16 times, of 6 once in 32, which is below the 5 per cent that the interval allows."""

BETTER, WORSE, UNKNOWN = "better", "worse", "cannot be told"


@dataclass(frozen=True)
class ErrorChange:
    """The difference of an error between two sensors that the same objects pressed.

    Attributes:
        before, after: mean errors of the two.
        low, high: the ends of the 95 % interval of after - before.
        objects: how many things pressed, which is what the interval rests on.
    """

    before: float
    after: float
    low: float
    high: float
    objects: int

    @property
    def change(self) -> float:
        """after - before; below 0 the second sensor reads better."""
        return self.after - self.before

    @property
    def verdict(self) -> str:
        """BETTER, WORSE or UNKNOWN, of the second sensor."""
        if self.objects < LEAST_OBJECTS:
            return UNKNOWN
        if self.high < 0.0:
            return BETTER
        return WORSE if self.low > 0.0 else UNKNOWN

    def to_dict(self) -> dict[str, float | str | int]:
        """All of it, ready for JSON."""
        return {
            "before": self.before,
            "after": self.after,
            "change": self.change,
            "low": self.low,
            "high": self.high,
            "confidence": CONFIDENCE,
            "objects": self.objects,
            "verdict": self.verdict,
        }


def error_change(before: FloatArray, after: FloatArray, seed: int = 0) -> ErrorChange:
    """Compare the errors of two sensors on the same presses.

    A bootstrap in two stages: objects are drawn with replacement, then places of each object
    (Davison and Hinkley, "Bootstrap Methods and their Application", 1997, section 3.8). Readers
    are drawn for each sensor by itself, since theirs have nothing to do with each other.

    Args:
        before, after: (objects, places, readers) errors, higher is worse; both of the same presses.
        seed: of the resamples.
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
