"""Objectives, and arithmetic expressions of them, as smooth functions of chief rays."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from inspect import signature
from typing import TYPE_CHECKING, Any

import numpy as np

from optisense.errors import ObjectiveError
from optisense.objectives.expressions import Expression, ScoreTerm
from optisense.objectives.smooth import SMOOTH, Slopes

if TYPE_CHECKING:
    from optisense.optics.transport.ray_gradient import DifferentiableRays

STEP = 1e-6
"""Step of central differences of arithmetic, absolute or, for values above 1, relative; it is near
the cube root of double precision (6e-6), at which central differences are most accurate.
"""


@dataclass(frozen=True)
class SmoothScore:
    """Objective, or expression of several, whose value is a smooth function of chief rays."""

    expression: Expression

    @staticmethod
    def of(text: str) -> SmoothScore | None:
        """Return the smooth form of an objective or an expression; None if a part has none."""
        try:
            expression = Expression.parse(text)
        except ObjectiveError:  # a function of a program or a file
            return None
        smooth = all(each.objective in SMOOTH and not each.part for each in expression.quantities)
        return SmoothScore(expression) if smooth else None

    def slopes(self, rays: DifferentiableRays, settings: Mapping[str, Any]) -> Slopes:
        """Return the value for some rays, and its derivatives by their points and directions.
        Settings that a smooth form lacks are ignored.
        """
        found: dict[ScoreTerm, Slopes] = {}
        for each in self.expression.quantities:
            smooth = SMOOTH[each.objective]
            known = signature(smooth).parameters
            found[each] = smooth(rays, **{k: v for k, v in settings.items() if k in known})
        values = {each: slopes.value for each, slopes in found.items()}
        cosine, points = np.zeros_like(rays.cosine), np.zeros_like(rays.points)
        weight = np.zeros_like(rays.weight)
        for each, slopes in found.items():
            by_term = self._slope(values, each)
            weight += by_term * slopes.weight
            if slopes.cosine is not None:
                cosine += by_term * slopes.cosine
            if slopes.points is not None:
                points += by_term * slopes.points
        return Slopes(self.expression.value(values), cosine, weight, points)

    def _slope(self, values: Mapping[ScoreTerm, float], by: ScoreTerm) -> float:
        """Return the derivative of the expression by one of the values in it."""
        step = STEP * max(1.0, abs(values[by]))
        after, before = ({**values, by: values[by] + side * step} for side in (1.0, -1.0))
        return (self.expression.value(after) - self.expression.value(before)) / (2.0 * step)
