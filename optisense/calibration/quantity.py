"""Single number that a calibration fits."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

from optisense.design import SensorDesign

LARGEST_POWER = 20.0
"""Largest logarithm of the factor on a number's start, a factor of 5e8, so that no trial step
overflows; the limits of each number are far narrower.
"""


@dataclass(frozen=True)
class FitQuantity:
    """Single number that is fitted.

    Attributes:
        path: path in the design, or a name of that form if several values follow from the number.
        words: description of the number.
        unit: unit of the number; empty if it has none.
        start: value before the fit.
        low, high: limits.
        plausible_range: standard deviation of the number's prior, a normal distribution about the
            start; of its logarithm if `logarithmic`.
        logarithmic: whether it varies by factors.
        renders: whether a change needs a new rendering.
        moves_contacts: whether balls must be pressed in anew after a change, so that they touch
            where the photographs show them.
        change: function that returns the design with a value of the number; None if it is the value
            at `path`.
        home: path under which the design records the source of the number; `path` if empty.
        views: whether it only changes what the camera sees of the skin, so that the derivatives of
            pictures follow from chief rays.
        guessed: whether the design has no such number, so that the start is a guess.
    """

    path: str
    words: str
    unit: str
    start: float
    low: float
    high: float
    plausible_range: float
    logarithmic: bool = False
    renders: bool = False
    moves_contacts: bool = False
    change: Callable[[SensorDesign, float], SensorDesign] | None = field(
        default=None, repr=False, compare=False
    )
    home: str = ""
    views: bool = False
    guessed: bool = False

    def value(self, step: float) -> float:
        """Return the number at a distance of `step` plausible ranges from its start."""
        if self.logarithmic:
            power = min(max(self.plausible_range * step, -LARGEST_POWER), LARGEST_POWER)
            found = self.start * math.exp(power)
        else:
            found = self.start + self.plausible_range * step
        return min(max(found, self.low), self.high)

    def limits(self) -> tuple[float, float]:
        """Return the distances of the limits from the start, in plausible ranges."""
        low, high = (self._step(limit) for limit in (self.low, self.high))
        return low, high

    def _step(self, value: float) -> float:
        if not self.logarithmic:
            return (value - self.start) / self.plausible_range
        return math.log(value / self.start) / self.plausible_range if value > 0.0 else -math.inf

    def slope(self, step: float) -> float:
        """Return the change of the number per plausible range."""
        return self.plausible_range * (self.value(step) if self.logarithmic else 1.0)
