"""Gradient ascent, with conditions.

Quasi-Newton steps within bounds (L-BFGS-B: Byrd, Lu, Nocedal and Zhu, "A limited memory algorithm
for bound constrained optimization", SIAM J. Sci. Comput. 16, 1995). The source of the gradients
depends on the parameters and the objective (`GradientSource`):

- scores that chief rays decide, over shapes of mirrors and the camera: a smoothed form of the score
  (`optisense.objectives.smooth`), whose derivatives come from retracing the rays, in each trial;
- colours and powers of lights: differences of scores of relit pictures, in each trial. Pictures are
  sums of layers, so these are exact and need no rendering;
- everything else, such as poses of lights and coatings: central differences of scores. The points
  at both sides are trials of their own, which workers score at the same time.

The stored scores are the true ones. Conditions are met by an augmented Lagrangian
(`optisense.search.methods._augmented_lagrangian`).

A point that constraints on shapes forbid is replaced by the nearest feasible one
(`optisense.search.methods._feasible`), so that the ascent slides along the constraint and no trial
is spent. An ascent that treated the forbidden point as a bad one stopped at the first wall.

At the start the ray derivative is compared with central differences of the true score
(`optisense.search.methods.checked_gradients`). The gradient consists of central differences by each
parameter if the two disagree, if rays have no derivative (by the shape of a transparent part), or
if there are few parameters.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from optisense.array_types import FloatArray
from optisense.errors import SearchError
from optisense.search.evaluation.evaluator import RELIGHTS, DesignEvaluator, Evaluator
from optisense.search.evaluation.models import SameMirrors, may_change_view
from optisense.search.evaluation.outcome import Outcome
from optisense.search.evaluation.relit import RelitEvaluator
from optisense.search.evaluation.requirements import Requirement
from optisense.search.methods._augmented_lagrangian import (
    CONDITION_TOLERANCE,
    ROUNDS,
    AugmentedLagrangian,
)
from optisense.search.methods._feasible import FeasiblePoint, FeasibleRegion
from optisense.search.methods.base import Method, Problem
from optisense.search.methods.checked_gradients import (
    FEW_PARAMETERS,
    GRADIENT_BY,
    GRADIENT_HOLDS,
    LIMITED,
    SMOOTHED,
    TOLERANCE,
    GradientEvaluator,
)
from optisense.search.methods.score_differences import (
    STEP,
    GradientSource,
    LocalValues,
    PointsWantedError,
    TrialDifferences,
    source_of,
)
from optisense.search.space.search_space import BoundSpace

DEFAULT_STEPS = 12
"""Number of steps of an ascent by differences of trials, where no budget is given; a step over n
parameters takes 2 n + 1 trials.
"""

DEFAULT_BUDGET = 40
"""Number of trials where no budget is given. A trial gives the score and all its slopes, so an
ascent needs tens of trials and not hundreds.
"""

CONVERGED = 1e-4
"""Smallest gain of a step, absolute or, for scores above 1, relative, that does not end the ascent.
Smaller gains are within the jumps of true scores: an AOAP of 320 rays has an error of about 3e-4.
"""


class Gradient(Method):
    """L-BFGS-B from the design as it is, and then from other points of the space."""

    name = "gradient"
    summary = "ascent by derivatives: of rays, of relit pictures, or finite differences"

    def __init__(
        self,
        problem: Problem,
        *,
        resolution: int = 320,
        memory: int = 10,
        starts: int = 4,
    ) -> None:
        """Determine the source of the gradient.

        Args:
            resolution: number of rays across the image for gradients.
            memory: number of steps that the quasi-Newton method remembers.
            starts: number of ascents: the first from the design as it is, the others, as far as the
                budget allows, from points spread evenly over the space.

        Raises:
            SearchError: a parameter has no gradient.
        """
        super().__init__(problem)
        self.objective = problem.objectives[0]
        self.requirements = tuple(Requirement.parse(text) for text in problem.requirements)
        if resolution < 16:
            raise SearchError(
                f"a resolution of {resolution} rays is too coarse for gradients",
                hint="Give 16 or more",
            )
        if starts < 1:
            raise SearchError(f"there are {starts} starts", hint="Give 1 or more")
        self.resolution, self.memory = resolution, memory
        self._starts = _starts(problem, starts)
        self.source, self.parts = source_of(problem)
        self._differences = TrialDifferences(problem, self.requirements)
        self._start_unit = self._unit(self.space.start)
        self._known: dict[bytes, Outcome] = {}
        self._region: FeasibleRegion | None = None
        self._places: dict[bytes, FeasiblePoint] = {}

    @classmethod
    def default_budget(cls, space: BoundSpace) -> int:
        """Return a budget that is usually enough to converge; for ray derivatives and relit
        pictures it does not depend on the number of parameters.
        """
        if all(map(RELIGHTS.search, space.names)) or may_change_view(space.names):
            return DEFAULT_BUDGET
        return DEFAULT_STEPS * (2 * space.size + 1)

    def evaluator(self, usual: DesignEvaluator) -> Evaluator:
        """Return an evaluator of scores and their slopes."""
        rules = [*usual.constraints, *usual.kept]
        shapes = [rule for rule in rules if not isinstance(rule, SameMirrors)]  # it needs rays
        region = FeasibleRegion(self.space, shapes, self.parts)
        self._region = region if shapes and region.allows(self._start_unit) else None
        if self.source is GradientSource.TRIALS:
            return usual
        relit = self.source is GradientSource.LAYERS
        scored = RelitEvaluator(usual) if relit else usual
        seed = self.problem.seed
        return GradientEvaluator(
            scored, self.parts, self.objective, self.resolution, seed, layers=relit
        )

    def ask(self) -> FloatArray:
        """Return the next points (k, n) that L-BFGS-B needs; none when all ascents converged."""
        try:
            for start in self._starts:
                self._climb(self._unit(start))
        except PointsWantedError as wanted:
            return wanted.points
        return np.empty((0, self.space.size))

    def _climb(self, unit: FloatArray) -> None:
        """Ascend from a point (n,), in units of the ranges, until its conditions are met. This and
        the methods below raise PointsWantedError if points must be scored first.
        """
        if not self.requirements:
            self._ascend_again(unit, None)
            return
        known = self._around(self._point(unit))
        if known is None:
            return
        merit = AugmentedLagrangian.initial(
            self.requirements, float(known.values[0]), self._offsets(unit, known)
        )
        best = -np.inf
        for _ in range(ROUNDS):
            value, unit = self._ascend_again(unit, merit)
            known = self._around(self._point(unit))
            if known is None:
                return
            merit = merit.updated(known.values, self._offsets(unit, known))
            if merit.violation <= CONDITION_TOLERANCE and not value - best > CONVERGED * max(
                1.0, abs(value)
            ):
                return
            best = value

    def _offsets(self, unit: FloatArray, known: LocalValues) -> FloatArray:
        """Return the differences (m,) between exact and smooth values of limited quantities."""
        true = self._known[self._point(unit).tobytes()].conditions
        exact = [true.get(str(each)) for each in self.requirements]
        smooth = known.values[1:]
        return np.array(
            [0.0 if one is None else one - two for one, two in zip(exact, smooth, strict=True)]
        )

    def _ascend_again(
        self, unit: FloatArray, merit: AugmentedLagrangian | None
    ) -> tuple[float, FloatArray]:
        """Ascend from a point (n,), and again from the best point that was reached, as long as that
        gains something: a line search fails at a kink, and a path along a constraint ends where the
        direction of ascent leaves it. Return the maximum of the merit function, or of the score,
        and its point.
        """
        best = -np.inf
        while True:
            value, unit = self._ascend(unit, merit)
            if not value - best > CONVERGED * max(1.0, abs(value)):  # NaN if none has a score
                return max(best, value), unit
            best = value

    def _ascend(
        self, start: FloatArray, merit: AugmentedLagrangian | None
    ) -> tuple[float, FloatArray]:
        """Return the best value that an ascent from a point (n,) reaches, and its point, in units
        of the ranges.
        """
        from scipy.optimize import minimize

        best, at, worst = -np.inf, start, np.inf
        allowed = self._start_unit

        def downhill(unit: FloatArray) -> tuple[float, FloatArray]:
            nonlocal best, at, allowed, worst
            placed = self._placed(unit, allowed)
            known = self._around(self._point(placed.point))
            if known is None:  # no score: try a shorter step
                return (1.0 - worst if np.isfinite(worst) else 1.0), np.zeros_like(unit)
            if merit is None:
                value, gradient = float(known.values[0]), known.gradients[0]
            else:
                value, gradient = merit.merit(*known)
            allowed, worst = placed.point, min(worst, value)
            if value > best:
                best, at = value, placed.point
            return -value, -placed.along(gradient)

        minimize(
            downhill,
            start,
            jac=True,
            method="L-BFGS-B",
            bounds=[(0.0, 1.0)] * self.space.size,
            options={
                "maxcor": self.memory,
                "ftol": CONVERGED,
                "maxiter": 10_000,
                "maxfun": 100_000,
            },
        )
        return best, at

    def _around(self, point: FloatArray) -> LocalValues | None:
        """Return values and gradients at a point (n,), or None if it has no score."""
        if self.source is GradientSource.TRIALS:
            return self._differences.around(point, self._known)
        outcome = self._known.get(point.tobytes())
        if outcome is None:
            raise PointsWantedError(point[None])
        if outcome.gradient is None:
            return None
        facts = outcome.parts[self.objective]
        values = np.array([facts[SMOOTHED], *facts.get(LIMITED, [])])
        return LocalValues(values, outcome.gradient.reshape(len(values), -1) * self.space.span)

    def _placed(self, unit: FloatArray, allowed: FloatArray) -> FeasiblePoint:
        """Return the nearest feasible point to a wanted one (n,), which is scored in its place."""
        if self._region is None:
            return FeasiblePoint.unchanged(unit)
        key = unit.tobytes()
        if key not in self._places:
            self._places[key] = self._region.nearest(unit, allowed)
        return self._places[key]

    def _unit(self, point: FloatArray) -> FloatArray:
        """Return a point (n,) in units of the ranges."""
        return np.clip(self.space.to_unit(point), 0.0, 1.0)

    def _point(self, unit: FloatArray) -> FloatArray:
        """Return the point (n,) for units of the ranges; the start, which is scored already,
        unrounded.
        """
        return np.where(unit == self._start_unit, self.space.start, self.space.from_unit(unit))

    def tell(self, vectors: FloatArray, outcomes: Sequence[Outcome]) -> None:
        """Store the outcomes of a generation (k, n), with their gradients, by their points."""
        for vector, outcome in zip(vectors, outcomes, strict=True):
            self._known[np.asarray(vector, dtype=np.float64).tobytes()] = outcome

    def notes(self) -> list[str]:
        """Return notes on where gradients are differences, where scores have none, and why."""
        found = [o.parts[self.objective] for o in self._known.values() if o.gradient is not None]
        by_differences = sum(
            parts[GRADIENT_BY] == GradientSource.DIFFERENCES.value for parts in found
        )
        checked = [parts for parts in found if GRADIENT_HOLDS in parts]
        unsteady = [parts for parts in checked if not parts[GRADIENT_HOLDS]]
        by_rays = sum(parts[GRADIENT_BY] == GradientSource.RAYS.value for parts in unsteady)
        notes = []
        if by_differences:
            why = (
                f"with at most {FEW_PARAMETERS} parameters they cost no more than ray derivatives"
                if self.space.size <= FEW_PARAMETERS
                else f"derivatives of rays are more than {TOLERANCE:.0%} off there, or there are "
                "none"
            )
            notes.append(
                f"the gradients at {by_differences} of {len(found)} points are "
                f"differences of scores over {STEP:.0%} of the ranges: {why}"
            )
        if unsteady:
            notes.append(
                f"{self.objective} has no steady derivative at {len(unsteady)} of "
                f"{len(checked)} points where that was checked: its rate of change over "
                f"{STEP / 2:.1%} of the ranges is more than {TOLERANCE:.0%} off that over "
                f"{STEP:.0%}, because rows of pixels or triangles come into view at once, an edge "
                "reaches the picture's border, or single rays change their path. The "
                f"gradients used there ({by_rays} of the smoothed score, by "
                f"rays; {len(unsteady) - by_rays} by differences) show the "
                "direction of ascent only roughly; --method cma-es needs no gradient"
            )
        return notes


def _starts(problem: Problem, count: int) -> FloatArray:
    """Return the points (count, n) at which the ascents start, the design as it is first."""
    from scipy.stats import qmc

    space = problem.space
    cube = qmc.LatinHypercube(space.size, seed=problem.random("gradient"))
    spread = cube.random(count - 1)
    return np.concatenate([space.start[None], space.lower + spread * space.span])
