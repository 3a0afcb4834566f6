"""Sources of the gradient of a search, and gradients by differences of scores."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from enum import Enum
from typing import NamedTuple

import numpy as np

from optisense.array_types import FloatArray
from optisense.design import SensorDesign
from optisense.errors import ObjectiveError, OptiSenseError, SearchError
from optisense.objectives.named import are_rays_only
from optisense.search.evaluation.evaluator import RELIGHTS, DesignEvaluator
from optisense.search.evaluation.outcome import Outcome
from optisense.search.evaluation.requirements import Requirement
from optisense.search.methods._jacobian import moving_parts
from optisense.search.methods._smooth_scores import SmoothScore
from optisense.search.methods.base import Problem
from optisense.search.space.search_space import BoundSpace

STEP = 0.05
"""Step of central differences of the true score to each side, as a share of the parameters' ranges.
Over shorter steps a difference says little about the direction of ascent, as a true score jumps
where rows of pixels or triangles come into view. Checks also use half of this step."""


class GradientSource(Enum):
    """A source of gradients, with its name in outcomes."""

    RAYS = "derivatives of rays"
    LAYERS = "differences of scores of relit pictures"
    DIFFERENCES = "differences of scores"
    TRIALS = "differences of trials"


class LocalValues(NamedTuple):
    """Values and gradients at a point: values (1 + m,) of the score and the limited quantities, and
    their gradients (1 + m, n) by units of the ranges.
    """

    values: FloatArray
    gradients: FloatArray


class PointsWantedError(Exception):
    """Signal that ends a run of the optimiser at points (k, n) that have no score yet."""

    def __init__(self, points: FloatArray) -> None:
        super().__init__()
        self.points = points


def source_of(problem: Problem) -> tuple[GradientSource, list[str]]:
    """Return the source of the gradients for a problem, and for derivatives of rays also the parts
    that points move; SearchError if a parameter has no gradient.
    """
    space, objective = problem.space, problem.objectives[0]
    for number in np.flatnonzero(space.discrete):
        raise SearchError(
            "a choice or a whole number has no gradient",
            where=space.names[number],
            hint="Search it with --method grid, or vary it with cma-es",
        )
    try:
        rays_only = are_rays_only([objective])
    except ObjectiveError:  # a function of the caller's program
        return GradientSource.TRIALS, []
    if not rays_only:
        relit = all(RELIGHTS.search(name) for name in space.names)
        return (GradientSource.LAYERS if relit else GradientSource.TRIALS), []
    if SmoothScore.of(objective) is None:
        return GradientSource.TRIALS, []
    return GradientSource.RAYS, moving_parts(space)


class TrialDifferences:
    """Central differences of trials over `STEP` of the ranges, or as far as the bounds allow."""

    def __init__(self, problem: Problem, requirements: Sequence[Requirement]) -> None:
        """Store what is differentiated: the first objective, and what conditions limit."""
        self._space, self._objective = problem.space, problem.objectives[0]
        self._requirements = requirements

    def around(self, point: FloatArray, known: Mapping[bytes, Outcome]) -> LocalValues | None:
        """Return values and gradients at a point (n,), or None if it has no score;
        PointsWantedError if points must be scored first. If the trial on one side failed, the
        difference is one-sided.
        """
        sides = self._beside(point)
        wanted = [each for each in (point, *sides) if each.tobytes() not in known]
        if wanted:
            raise PointsWantedError(np.array(wanted))
        values = self._exact(known[point.tobytes()])
        if values is None:
            return None
        gradients = np.zeros((len(values), self._space.size))
        for number, span in enumerate(self._space.span):
            ends = []
            for side in sides[2 * number : 2 * number + 2]:
                exact = self._exact(known[side.tobytes()])
                place = (side[number] - point[number]) / span
                ends.append((0.0, values) if exact is None else (place, exact))
            (high, above), (low, below) = ends
            if high > low:
                gradients[:, number] = (above - below) / (high - low)
        return LocalValues(values, gradients)

    def _beside(self, point: FloatArray) -> list[FloatArray]:
        """Return two points (n,) for each parameter, above and below, within the bounds."""
        found = []
        for number, span in enumerate(self._space.span):
            low, high = self._space.lower[number], self._space.upper[number]
            for way in (STEP, -STEP):
                side = point.copy()
                side[number] = np.clip(point[number] + way * span, low, high)
                found.append(side)
        return found

    def _exact(self, outcome: Outcome) -> FloatArray | None:
        """Return the score and the limited quantities, (1 + m,), or None if one is missing."""
        limited = [outcome.conditions.get(str(each)) for each in self._requirements]
        values = [outcome.scores.get(self._objective, np.nan), *limited]
        if any(value is None or not np.isfinite(value) for value in values):
            return None
        return np.array(values, dtype=np.float64)


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
        for number, span in enumerate(space.span):
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
        """Return the values of objectives, (k,); OptiSenseError if the design has none for one of
        them.
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
