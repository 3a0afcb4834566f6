"""Gradient ascent, with conditions.

Quasi-Newton steps within bounds (L-BFGS-B: Byrd, Lu, Nocedal and Zhu, "A limited memory algorithm
for bound constrained optimization", SIAM J. Sci. Comput. 16, 1995). Where gradients come from
depends on what is searched (`GradientSource`):

- scores that chief rays decide, over shapes of mirrors and the camera: a smoothed form of the score
  (`optisense.objectives.smooth`), whose derivatives come from retracing the rays, in each trial;
- colours and powers of lights: differences of scores of relit pictures, in each trial. Pictures are
  sums of layers, so these are exact and need no rendering;
- everything else, such as poses of lights and coatings: central differences of scores. The points
  at both sides are trials of their own, which workers score at the same time.

The scores that are stored are the true ones. Conditions are kept by an augmented Lagrangian
(`optisense.search.methods.augmented_lagrangian`).

A point that constraints on shapes forbid is not tried: the nearest one that can be built is
(`optisense.search.methods.feasible`), so that the ascent slides along the constraint and no trial
is spent. An ascent that told the forbidden point as a bad one came to a stop at the first wall.

At the start the derivative of rays is compared with central differences of the true score
(`optisense.search.methods.checked_slopes`). Where the two disagree, where rays have no derivative
at all (by the shape of a transparent part), and where there are few parameters, the gradient is
taken from central differences by each parameter. The outcome says so, and it says where the score
itself steps, so that no gradient holds.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from optisense.errors import SearchError
from optisense.search.evaluation.evaluator import RELIT, DesignEvaluator, Evaluator
from optisense.search.evaluation.outcome import Outcome
from optisense.search.evaluation.requirements import Requirement
from optisense.search.evaluation.views import SameMirrors, may_change_view
from optisense.search.methods.augmented_lagrangian import KEPT, ROUNDS, AugmentedLagrangian
from optisense.search.methods.base import FloatArray, Method, Problem
from optisense.search.methods.checked_slopes import (
    DIFFERENCES,
    FEW,
    GRADIENT_BY,
    GRADIENT_HOLDS,
    LIMITED,
    RAYS,
    SMOOTHED,
    STEP,
    TOLERANCE,
    SlopeEvaluator,
)
from optisense.search.methods.feasible import FeasibleRegion, Placed
from optisense.search.methods.gradient_sources import (
    GradientSource,
    LocalValues,
    PointsWantedError,
    TrialDifferences,
    source_of,
)
from optisense.search.methods.jacobian import moving_parts
from optisense.search.methods.light_colours import RelitEvaluator
from optisense.search.space.search_space import BoundSpace

USUAL_STEPS = 12
"""Steps of an ascent whose points beside each other are trials, where no budget is given."""

USUAL_BUDGET = 40
"""Number of trials where none is given. A trial gives the score and all its slopes, so that an
ascent needs tens of them and not hundreds."""

CONVERGED = 1e-4
"""An ascent ends with a step that gains less than this, or this part of scores above 1. Smaller
gains are the steps of true scores (an AOAP of 320 rays is good to about 3e-4)."""


class Gradient(Method):
    """L-BFGS-B from the design as it is, and then from other points of the space."""

    name = "gradient"
    summary = "steepest way up by derivatives: of rays, of relit pictures, or of differences"

    def __init__(
        self,
        problem: Problem,
        *,
        resolution: int = 320,
        memory: int = 10,
        starts: int = 4,
    ) -> None:
        """Find out where the gradient comes from.

        Args:
            problem: what to search.
            resolution: rays across the image for gradients.
            memory: how many steps the quasi-Newton method remembers.
            starts: how many ascents there are: the first from the design as it is, the others, as
                far as the budget goes, from points spread evenly over the space.

        Raises:
            SearchError: a parameter has no gradient.
        """
        super().__init__(problem)
        self.objective = problem.objectives[0]
        self.requirements = tuple(Requirement.parse(text) for text in problem.requirements)
        if resolution < 16:
            raise SearchError(f"a resolution of {resolution} is too coarse for gradients")
        if starts < 1:
            raise SearchError(f"there are {starts} starts", hint="Give 1 or more")
        self.resolution, self.memory = int(resolution), int(memory)
        self._starts = _starts(problem, int(starts))
        self.source = source_of(problem)
        self.parts = moving_parts(problem.space) if self.source is GradientSource.RAYS else []
        self._differences = TrialDifferences(problem, self.requirements)
        span = self.space.upper - self.space.lower
        self._start_unit = np.clip((self.space.start - self.space.lower) / span, 0.0, 1.0)
        self._known: dict[bytes, Outcome] = {}
        self._message = ""
        self._region: FeasibleRegion | None = None
        self._places: dict[bytes, Placed] = {}

    @classmethod
    def usual_budget(cls, space: BoundSpace) -> int:
        """Enough to converge, as a rule, however many parameters there are."""
        turns_rays = not all(RELIT.search(name) for name in space.names) and may_change_view(
            space.names
        )
        if turns_rays or all(RELIT.search(name) for name in space.names):
            return USUAL_BUDGET
        return USUAL_STEPS * (2 * space.size + 1)

    def evaluator(self, usual: DesignEvaluator) -> Evaluator:
        """Scores and slopes."""
        rules = [*usual.constraints, *usual.kept]
        shapes = [rule for rule in rules if not isinstance(rule, SameMirrors)]  # which traces rays
        region = FeasibleRegion(self.space, shapes, self.parts)
        self._region = region if shapes and region.allows(self._start_unit) else None
        if self.source is GradientSource.TRIALS:
            return usual
        relit = self.source is GradientSource.LAYERS
        scored = RelitEvaluator(usual) if relit else usual
        return SlopeEvaluator(scored, self.parts, self.objective, self.resolution, layers=relit)

    def ask(self) -> FloatArray:
        """The next points (k, n) that L-BFGS-B wants to know of; none when all ascents have
        converged.
        """
        space = self.space
        try:
            for start in self._starts:
                unit = (start - space.lower) / (space.upper - space.lower)
                self._climb(np.clip(unit, 0.0, 1.0))
        except PointsWantedError as wanted:
            return wanted.points
        return np.empty((0, space.size))

    def _climb(self, unit: FloatArray) -> None:
        """Ascend from a point (n,), as parts of the ranges, until its conditions are kept.

        Raises:
            PointsWantedError: scores of points are wanted.
        """
        if not self.requirements:
            self._ascend_again(unit, None)
            return
        known = self._around(self._point(unit))
        if known is None:
            return
        merit = AugmentedLagrangian.begin(
            self.requirements, float(known.values[0]), self._offsets(unit, known)
        )
        best = -np.inf
        for _ in range(ROUNDS):
            value, unit = self._ascend_again(unit, merit)
            known = self._around(self._point(unit))
            if known is None:
                return
            merit = merit.after(known.values, self._offsets(unit, known))
            if merit.missing <= KEPT and not value - best > CONVERGED * max(1.0, abs(value)):
                return
            best = value

    def _offsets(self, unit: FloatArray, known: LocalValues) -> FloatArray:
        """(m,) what the smooth values of limited quantities lack to the true ones at a point."""
        true = self._known[self._point(unit).tobytes()].conditions
        exact = [true.get(str(each)) for each in self.requirements]
        smooth = known.values[1:]
        return np.array(
            [0.0 if one is None else one - two for one, two in zip(exact, smooth, strict=True)]
        )

    def _ascend_again(
        self, unit: FloatArray, merit: AugmentedLagrangian | None
    ) -> tuple[float, FloatArray]:
        """Ascend from a point (n,), and again from the best point that was reached, for as long as
        that gains something: a line search gives up at a kink, and slides along constraints end
        where the way leads off them again.

        Returns:
            What was maximised at the best point, and that point.

        Raises:
            PointsWantedError: scores of points are wanted.
        """
        best = -np.inf
        while True:
            value, unit = self._ascend(unit, merit)
            if not value - best > CONVERGED * max(1.0, abs(value)):  # NaN where none has a score
                return max(best, value), unit
            best = value

    def _ascend(
        self, start: FloatArray, merit: AugmentedLagrangian | None
    ) -> tuple[float, FloatArray]:
        """The best value that an ascent from a point (n,) reaches, and the point of that, both
        points as parts of the ranges.

        Raises:
            PointsWantedError: scores of points are wanted.
        """
        from scipy.optimize import minimize

        best, at, worst = -np.inf, start, np.inf
        allowed = self._start_unit

        def downhill(unit: FloatArray) -> tuple[float, FloatArray]:
            nonlocal best, at, allowed, worst
            placed = self._placed(unit, allowed)
            known = self._around(self._point(placed.point))
            if known is None:  # no score: a shorter step is tried
                return (1.0 - worst if np.isfinite(worst) else 1.0), np.zeros_like(unit)
            if merit is None:
                value, gradient = float(known.values[0]), known.gradients[0]
            else:
                value, gradient = merit.merit(*known)
            allowed, worst = placed.point, min(worst, value)
            if value > best:
                best, at = value, placed.point
            return -value, -placed.along(gradient)

        found = minimize(
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
        self._message = str(found.message)
        return best, at

    def _around(self, point: FloatArray) -> LocalValues | None:
        """What is known around a point (n,); None where it has no score.

        Raises:
            PointsWantedError: something must be scored first.
        """
        if self.source is GradientSource.TRIALS:
            return self._differences.around(point, self._known)
        outcome = self._known.get(point.tobytes())
        if outcome is None:
            raise PointsWantedError(point[None])
        if outcome.gradient is None:
            return None
        span = self.space.upper - self.space.lower
        facts = outcome.parts[self.objective]
        values = np.array([facts[SMOOTHED], *facts.get(LIMITED, [])])
        return LocalValues(values, outcome.gradient.reshape(len(values), -1) * span)

    def _placed(self, unit: FloatArray, allowed: FloatArray) -> Placed:
        """Where a wanted point (n,) is scored: at the nearest one that constraints allow."""
        key = unit.tobytes()
        if key not in self._places:
            if self._region is None:
                self._places[key] = Placed.unchanged(unit)
            else:
                self._places[key] = self._region.nearest(unit, allowed)
        return self._places[key]

    def _point(self, unit: FloatArray) -> FloatArray:
        """The point (n,) of parts of the ranges; the start as it is, which is scored already."""
        space = self.space
        point = np.clip(space.lower + unit * (space.upper - space.lower), space.lower, space.upper)
        return np.where(unit == self._start_unit, space.start, point)

    def tell(self, vectors: FloatArray, outcomes: Sequence[Outcome]) -> None:
        """Remember slopes by their points."""
        for vector, outcome in zip(vectors, outcomes, strict=True):
            self._known[np.asarray(vector, dtype=np.float64).tobytes()] = outcome

    def describe(self) -> dict[str, Any]:
        """How many gradients are known, how many of them come from differences, how many were
        compared with the score and do not hold because it steps, and why the ascent ended.
        """
        found = [o.parts[self.objective] for o in self._known.values() if o.gradient is not None]
        checked = [parts for parts in found if GRADIENT_HOLDS in parts]
        unsteady = [parts for parts in checked if not parts[GRADIENT_HOLDS]]
        return {
            "slopes": len(found),
            "by_differences": sum(parts[GRADIENT_BY] == DIFFERENCES for parts in found),
            "checked": len(checked),
            "unsteady": len(unsteady),
            "unsteady_by_rays": sum(parts[GRADIENT_BY] == RAYS for parts in unsteady),
            "ended": self._message,
        }

    def notes(self) -> list[str]:
        """Where gradients are differences of scores, where the score has none, and why."""
        facts = self.describe()
        notes = []
        if facts["by_differences"]:
            why = (
                f"with at most {FEW} parameters they cost no more than derivatives of rays"
                if self.space.size <= FEW
                else f"derivatives of rays are more than {TOLERANCE:.0%} off there, or there are "
                "none"
            )
            notes.append(
                f"the gradients at {facts['by_differences']} of {facts['slopes']} points are "
                f"differences of scores over {STEP:.0%} of the ranges: {why}"
            )
        if facts["unsteady"]:
            notes.append(
                f"{self.objective} has no steady derivative at {facts['unsteady']} of "
                f"{facts['checked']} points where that was checked: its rate of change over "
                f"{STEP / 2:.1%} of the ranges is more than {TOLERANCE:.0%} off that over "
                f"{STEP:.0%}, because rows of pixels or triangles come into view at once, an edge "
                "reaches the picture's border, or single rays go astray. The "
                f"gradients used there ({facts['unsteady_by_rays']} of the smoothed score, by "
                f"rays; {facts['unsteady'] - facts['unsteady_by_rays']} by differences) show the "
                "way up only roughly; --method cma-es needs none"
            )
        return notes


def _starts(problem: Problem, count: int) -> FloatArray:
    """(count, n) points to begin at, the design as it is first."""
    from scipy.stats import qmc

    space = problem.space
    cube = qmc.LatinHypercube(space.size, seed=problem.random("gradient"))
    spread = cube.random(count - 1)
    return np.concatenate([space.start[None], space.lower + spread * (space.upper - space.lower)])
