"""Derivatives of true scores by central differences."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from optisense.array_types import FloatArray
from optisense.design import SensorDesign
from optisense.errors import ObjectiveError, OptiSenseError
from optisense.search.evaluation.evaluator import DesignEvaluator
from optisense.search.space.search_space import BoundSpace

STEP = 0.05
"""Step of central differences of the true score to each side, as a share of the parameters' ranges.
A true score is a sum over pixels and triangles, which jumps where a row of pixels comes into view
and has small hills where an edge passes the picture's corner: over shorter steps a difference says
little about the direction of ascent. Checks also use half of this step.
"""


class ScoreDifferences:
    """Differences of the values of objectives between points of a search space."""

    def __init__(self, usual: DesignEvaluator) -> None:
        """Args: usual: evaluator of the points."""
        self._usual = usual

    def gradients(self, vector: FloatArray, seed: int, names: Sequence[str]) -> FloatArray:
        """Return the gradients (k, n) of objectives at a point (n,) by central differences over
        `STEP`; 0 for coordinates with no score on one of the sides.
        """
        space = self._usual.space
        gradients = np.zeros((len(names), space.size))
        for number, span in enumerate(space.upper - space.lower):
            way = np.zeros(space.size)
            way[number] = span
            found = self.along(vector, way, STEP, seed, names)
            gradients[:, number] = 0.0 if found is None else found / span
        return gradients

    def along(
        self, vector: FloatArray, way: FloatArray, step: float, seed: int, names: Sequence[str]
    ) -> FloatArray | None:
        """Return the derivatives (k,) of objectives along `way` (n,), per length of `way`, by
        differences over `step` to both sides, or as far as the bounds allow; None if that is less
        than half a step in all, or if there is no score on one of the sides.
        """
        space = self._usual.space
        room = [_room(space, vector, side * way, step) for side in (1.0, -1.0)]
        if sum(room) < step / 2:
            return None
        found = []
        for side in (room[0], -room[1]):
            point = np.clip(vector + side * way, space.lower, space.upper)
            try:
                found.append(self.exact(space.apply(point), seed, names))
            except OptiSenseError:
                return None
        return np.asarray((found[0] - found[1]) / sum(room))

    def exact(self, design: SensorDesign, seed: int, names: Sequence[str]) -> FloatArray:
        """Return the values of objectives, (k,).

        Raises:
            OptiSenseError: the design can't be built, or has no value for one of them.
        """
        scores = self._usual.objective_scores(design, seed, names)
        for name in names:
            failure = scores[name].failure
            if failure is not None:
                raise ObjectiveError(failure)
        return np.array([scores[name].value for name in names])


def _room(space: BoundSpace, vector: FloatArray, way: FloatArray, most: float) -> float:
    """Return the largest multiple of `way` (n,), up to `most`, from a point within the bounds."""
    ahead = np.where(way > 0, space.upper - vector, vector - space.lower)
    moving = way != 0
    return float(np.min(ahead[moving] / np.abs(way[moving]), initial=most).clip(0.0))
