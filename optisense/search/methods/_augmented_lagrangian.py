"""Augmented Lagrangian for conditions of gradient methods.

Each condition is written as g <= 0, where g is the violation as a share of the limit. The function
to minimise in place of -score is

    -score + sum over conditions of (max(0, m + w g)^2 - m^2) / (2 w)

with a multiplier m for each condition, and a weight w. After each ascent m = max(0, m + w g), and w
grows if the conditions are not met better than before (Nocedal and Wright, "Numerical
optimization", 2006, chapter 17.4). So the ascent converges to the limit itself and not beside it,
as with penalties alone, and w stays small enough for the problem to be well conditioned.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from optisense.array_types import FloatArray
from optisense.search.evaluation.requirements import Requirement

ROUNDS = 8
"""Largest number of ascents with new multipliers; conditions are usually met to
`CONDITION_TOLERANCE` after three.
"""

WEIGHT = 100.0
"""Weight of the first ascent, in units of the score at the start: a condition that misses its limit
by a tenth costs half of the score.
"""

WEIGHT_FACTOR = 5.0
"""Factor on the weight after an ascent that has not halved the violation."""

LIMIT_MARGIN = 0.004
"""Share of a limit by which an ascent stays on its allowed side. Scores are sums over pixels and
triangles and change in steps of about this size.
"""

CONDITION_TOLERANCE = 0.002
"""Tolerance of conditions at the end of an ascent, as a share of the limit; less than
`LIMIT_MARGIN`, so that the steps of a score do not make the point infeasible.
"""


@dataclass(frozen=True)
class AugmentedLagrangian:
    """Merit function of an ascent with conditions.

    Attributes:
        requirements: the conditions.
        multipliers: multipliers (m,), in units of the score.
        weight: weight of the violations, in units of the score.
        offsets: offsets (m,) that are added to the smooth value of each limited quantity to give
            its exact value.
        violation: largest violation g at the end of the ascent before.
    """

    requirements: tuple[Requirement, ...]
    multipliers: FloatArray
    weight: float
    offsets: FloatArray
    violation: float = np.inf

    @staticmethod
    def initial(
        requirements: Sequence[Requirement], score: float, offsets: FloatArray
    ) -> AugmentedLagrangian:
        """Return the merit function of the first ascent; see the attribute for `offsets` (m,)."""
        weight = WEIGHT * max(abs(score), CONDITION_TOLERANCE)
        return AugmentedLagrangian(
            tuple(requirements), np.zeros(len(requirements)), weight, offsets
        )

    def merit(self, values: FloatArray, gradients: FloatArray) -> tuple[float, FloatArray]:
        """Return the merit function, which is maximised, and its gradient (n,), for the score and
        the limited quantities, `values` (1 + m,), and their gradients (1 + m, n).
        """
        pull = np.maximum(0.0, self.multipliers + self.weight * self.violations(values))
        cost = float((pull**2 - self.multipliers**2).sum()) / (2.0 * self.weight)
        return float(values[0]) - cost, gradients[0] - (pull * self._signs()) @ gradients[1:]

    def violations(self, values: FloatArray) -> FloatArray:
        """Return g of each condition, (m,): positive where it misses its limit, or nearly."""
        limits = np.array([each.limit for each in self.requirements])
        return self._signs() * (values[1:] + self.offsets - limits) + LIMIT_MARGIN

    def updated(self, values: FloatArray, offsets: FloatArray) -> AugmentedLagrangian:
        """Return the merit function of the next ascent, for the score and the limited quantities (1
        + m,) at the end of the last one, and new offsets (m,).
        """
        violation = self.violations(values)
        most = float(violation.max())
        increased = most > CONDITION_TOLERANCE and most > 0.5 * self.violation
        return AugmentedLagrangian(
            self.requirements,
            np.maximum(0.0, self.multipliers + self.weight * violation),
            self.weight * (WEIGHT_FACTOR if increased else 1.0),
            offsets,
            most,
        )

    def _signs(self) -> FloatArray:
        """Return the derivative of g by the quantity, (m,): 1 / limit, negative for a lower one."""
        return np.array(
            [
                (-1.0 if each.at_least else 1.0) / (abs(each.limit) or 1.0)
                for each in self.requirements
            ]
        )
