"""Gradient ascent for scores that chief rays decide, on shapes of mirrors and on the camera.

Quasi-Newton steps within bounds (L-BFGS-B: Byrd, Lu, Nocedal and Zhu, "A limited memory algorithm
for bound constrained optimization", SIAM J. Sci. Comput. 16, 1995), on a smoothed form of the
score (`optisense.objectives.smooth`) whose derivatives come from retracing the rays. The scores
that are stored are the true ones.

A point that constraints on shapes forbid is not tried: the nearest one that can be built is
(`optisense.search.methods.feasible`), so that the ascent slides along the constraint and no trial
is spent. An ascent that told the forbidden point as a bad one came to a stop at the first wall.

At the start the derivative is compared with central differences of the true score
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
from optisense.objectives.smooth import SMOOTH
from optisense.search.evaluation.evaluator import DesignEvaluator, Evaluator
from optisense.search.evaluation.outcome import Outcome
from optisense.search.evaluation.views import SameMirrors
from optisense.search.methods.base import FloatArray, Method, Problem
from optisense.search.methods.checked_slopes import (
    DIFFERENCES,
    FEW,
    GRADIENT_BY,
    GRADIENT_HOLDS,
    RAYS,
    SMOOTHED,
    STEP,
    TOLERANCE,
    SlopeEvaluator,
)
from optisense.search.methods.feasible import FeasibleRegion, Placed
from optisense.search.methods.jacobian import moving_parts
from optisense.search.space.search_space import BoundSpace

USUAL_BUDGET = 40
"""Number of trials where none is given. A trial gives the score and all its slopes, so that an
ascent needs tens of them and not hundreds."""

CONVERGED = 1e-4
"""An ascent ends with a step that gains less than this, or this part of scores above 1. Smaller
gains are the steps of true scores (an AOAP of 320 rays is good to about 3e-4)."""


class Gradient(Method):
    """L-BFGS-B from the design as it is, and then from other points of the space."""

    name = "gradient"
    summary = "steepest way up by derivatives, for chief-ray scores of mirrors and cameras"

    def __init__(
        self,
        problem: Problem,
        *,
        resolution: int = 320,
        memory: int = 10,
        starts: int = 4,
    ) -> None:
        """Check that there is a gradient.

        Args:
            problem: what to search; its first objective is aoap or 2to3pw.
            resolution: rays across the image for gradients.
            memory: how many steps the quasi-Newton method remembers.
            starts: how many ascents there are: the first from the design as it is, the others, as
                far as the budget goes, from points spread evenly over the space.

        Raises:
            SearchError: the objective or a parameter has no gradient.
        """
        super().__init__(problem)
        self.objective = problem.objectives[0]
        if self.objective not in SMOOTH:
            raise SearchError(
                f"'{self.objective}' has no gradient",
                hint=f"Only {' and '.join(SMOOTH)} have one; use cma-es for others",
            )
        if problem.requirements:
            raise SearchError(
                "the method 'gradient' can't keep conditions, which have no gradient",
                hint="Use --method cma-es with --require",
            )
        if resolution < 16:
            raise SearchError(f"a resolution of {resolution} is too coarse for gradients")
        if starts < 1:
            raise SearchError(f"there are {starts} starts", hint="Give 1 or more")
        self.resolution, self.memory = int(resolution), int(memory)
        self._starts = _starts(problem, int(starts))
        self.parts = moving_parts(problem.space)
        span = self.space.upper - self.space.lower
        self._start_unit = np.clip((self.space.start - self.space.lower) / span, 0.0, 1.0)
        self._known: dict[bytes, Outcome] = {}
        self._message = ""
        self._region: FeasibleRegion | None = None
        self._places: dict[bytes, Placed] = {}

    @classmethod
    def usual_budget(cls, space: BoundSpace) -> int:
        """Enough to converge, as a rule, however many parameters there are."""
        return USUAL_BUDGET

    def evaluator(self, usual: DesignEvaluator) -> Evaluator:
        """Scores and slopes."""
        rules = [*usual.constraints, *usual.kept]
        shapes = [rule for rule in rules if not isinstance(rule, SameMirrors)]  # which traces rays
        region = FeasibleRegion(self.space, shapes, self.parts)
        self._region = region if shapes and region.allows(self._start_unit) else None
        return SlopeEvaluator(usual, self.parts, self.objective, self.resolution)

    def ask(self) -> FloatArray:
        """The next point (1, n) that L-BFGS-B wants to know of; none when all ascents have
        converged.
        """
        space = self.space
        try:
            for start in self._starts:
                unit = (start - space.lower) / (space.upper - space.lower)
                self._climb(np.clip(unit, 0.0, 1.0))
        except _PointWantedError as wanted:
            return wanted.point[None]
        return np.empty((0, space.size))

    def _climb(self, unit: FloatArray) -> None:
        """Ascend from a point (n,), as parts of the ranges, and again from the best point that was
        reached, for as long as that gains something: a line search gives up at a kink, and slides
        along constraints end where the way leads off them again.

        Raises:
            _PointWantedError: the score of a point is wanted.
        """
        best = -np.inf
        while True:
            value, unit = self._ascend(unit)
            if not value - best > CONVERGED * max(1.0, abs(value)):  # NaN where none has a score
                return
            best = value

    def _ascend(self, start: FloatArray) -> tuple[float, FloatArray]:
        """The best smoothed score that an ascent from a point (n,) reaches, and the point of that,
        both points as parts of the ranges.

        Raises:
            _PointWantedError: the score of a point is wanted.
        """
        from scipy.optimize import minimize

        best, at = -np.inf, start
        allowed = self._start_unit

        def downhill(unit: FloatArray) -> tuple[float, FloatArray]:
            nonlocal best, at, allowed
            placed = self._placed(unit, allowed)
            point = self._point(placed.point)
            outcome = self._known.get(point.tobytes())
            if outcome is None:
                raise _PointWantedError(point)
            if outcome.gradient is None:
                return self._worst(), np.zeros_like(unit)  # no score: a shorter step is tried
            allowed, value = placed.point, _smoothed(outcome, self.objective)
            if value > best:
                best, at = value, placed.point
            span = self.space.upper - self.space.lower
            return -value, -placed.along(outcome.gradient * span)

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

    def _worst(self) -> float:
        values = [_smoothed(o, self.objective) for o in self._known.values() if not o.failed]
        return 1.0 - min(values, default=0.0)


class _PointWantedError(Exception):
    """Ends a run of the optimiser at a point whose score is not known yet."""

    def __init__(self, point: FloatArray) -> None:
        super().__init__()
        self.point = point


def _starts(problem: Problem, count: int) -> FloatArray:
    """(count, n) points to begin at, the design as it is first."""
    from scipy.stats import qmc

    space = problem.space
    cube = qmc.LatinHypercube(space.size, seed=problem.random("gradient"))
    spread = cube.random(count - 1)
    return np.concatenate([space.start[None], space.lower + spread * (space.upper - space.lower)])


def _smoothed(outcome: Outcome, objective: str) -> float:
    return float(outcome.parts[objective][SMOOTHED])
