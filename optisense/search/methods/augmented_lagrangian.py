"""Conditions for methods that climb: an augmented Lagrangian.

Each condition is written as g <= 0, where g is what is missing as a part of the limit. What is
minimised in place of -score is

    -score + sum over conditions of (max(0, m + w g)^2 - m^2) / (2 w)

with a multiplier m for each, and a weight w. Each ascent is followed by m = max(0, m + w g), and w
grows where the conditions are not kept better than before (Nocedal and Wright, "Numerical
optimization", 2006, chapter 17.4). So the ascent ends on the limit itself and not beside it, as
with penalties alone, and w stays small enough to climb.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from optisense.search.evaluation.requirements import Requirement

FloatArray = NDArray[np.float64]

ROUNDS = 8
"""Ascents with new multipliers at most; conditions are usually kept to `KEPT` after three."""

WEIGHT = 100.0
"""First weight, in scores of the start: a condition that misses its limit by a tenth costs half of
the score."""

HEAVIER = 5.0
"""Factor on the weight where an ascent has not halved what is missing."""

ASIDE = 0.004
"""Part of a limit by which an ascent stays on its allowed side: scores that are told step by about
that much, since pixels and triangles are counted."""

KEPT = 0.002
"""Part of a limit, less than `ASIDE`, to which conditions are kept where ascents end."""


@dataclass(frozen=True)
class AugmentedLagrangian:
    """The function that an ascent minimises.

    Attributes:
        requirements: the conditions.
        multipliers: (m,) in units of the score.
        weight: of what is missing, in units of the score.
        offsets: (m,) what is added to the smooth value of each limited quantity, so that it is the
            value that counts.
        missing: the largest g of the ascent before.
    """

    requirements: tuple[Requirement, ...]
    multipliers: FloatArray
    weight: float
    offsets: FloatArray
    missing: float = np.inf

    @staticmethod
    def begin(
        requirements: Sequence[Requirement], score: float, offsets: FloatArray
    ) -> AugmentedLagrangian:
        """The one of the first ascent; `score` is that of the start."""
        weight = WEIGHT * max(abs(score), KEPT)
        return AugmentedLagrangian(
            tuple(requirements), np.zeros(len(requirements)), weight, offsets
        )

    def merit(self, values: FloatArray, gradients: FloatArray) -> tuple[float, FloatArray]:
        """The merit function, which is maximised, and its gradient (n,).

        Args:
            values: (1 + m,) the score, and the limited quantity of each condition.
            gradients: (1 + m, n) of these.
        """
        pull = np.maximum(0.0, self.multipliers + self.weight * self.missing_of(values))
        cost = float((pull**2 - self.multipliers**2).sum()) / (2.0 * self.weight)
        return float(values[0]) - cost, gradients[0] - (pull * self._signs()) @ gradients[1:]

    def missing_of(self, values: FloatArray) -> FloatArray:
        """(m,) g of each condition: above 0 where it misses its limit, or comes too near to it."""
        limits = np.array([each.limit for each in self.requirements])
        return self._signs() * (values[1:] + self.offsets - limits) + ASIDE

    def after(self, values: FloatArray, offsets: FloatArray) -> AugmentedLagrangian:
        """The one for the next ascent, where the last one ended at these values (1 + m,)."""
        missing = self.missing_of(values)
        most = float(missing.max())
        heavier = most > KEPT and most > 0.5 * self.missing
        return AugmentedLagrangian(
            self.requirements,
            np.maximum(0.0, self.multipliers + self.weight * missing),
            self.weight * (HEAVIER if heavier else 1.0),
            offsets,
            most,
        )

    def _signs(self) -> FloatArray:
        """(m,) how g changes with the quantity: by one over the limit, down where it is a least
        value."""
        return np.array(
            [
                (-1.0 if each.at_least else 1.0) / (abs(each.limit) or 1.0)
                for each in self.requirements
            ]
        )
