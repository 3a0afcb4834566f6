"""Gradient ascent for scores that chief rays decide, on shapes of mirrors and on the camera.

Quasi-Newton steps within bounds (L-BFGS-B: Byrd, Lu, Nocedal and Zhu, "A limited memory algorithm
for bound constrained optimization", SIAM J. Sci. Comput. 16, 1995), on a smoothed form of the
score (`optisense.objectives.smooth`) whose derivatives come from retracing the rays. The scores
that are stored are the true ones.

At each point the derivative is compared with central differences of the true score. Where the two
disagree, where rays have no derivative at all (by the shape of a transparent part), and where there
are few parameters, the gradient is taken from central differences by each parameter, and the
outcome says so.
"""

from __future__ import annotations

import time
import zlib
from collections.abc import Sequence
from inspect import signature
from typing import TYPE_CHECKING, Any

import numpy as np

from optisense.design import SensorDesign
from optisense.errors import NoDerivativeError, OptiSenseError, SearchError
from optisense.objectives.smooth import SMOOTH, Slopes
from optisense.search.evaluation.evaluator import DesignEvaluator, Evaluator
from optisense.search.evaluation.outcome import Outcome
from optisense.search.methods.base import FloatArray, Method, Problem
from optisense.search.methods.jacobian import Jacobian, holds, jacobian, moving_parts
from optisense.search.space.search_space import BoundSpace

if TYPE_CHECKING:
    from optisense.optics.transport.ray_gradient import DifferentiableRays

USUAL_BUDGET = 40
STEP = 0.05
"""Central differences of the true score go so far to both sides, as a part of the parameters'
ranges. A true score is a sum over pixels and triangles, which steps where a row of pixels comes
into view, and which has small hills where an edge passes the picture's corner: over less than
about this a derivative says little about the way up."""

CONVERGED = 1e-4
"""An ascent ends with a step that gains less than this, or this part of scores above 1. Smaller
gains are the steps of true scores (an AOAP of 320 rays is good to about 3e-4)."""

FEW = 8
"""With at most so many parameters differences by each cost no more scores than derivatives and the
comparison with differences do. Over `STEP` they also see past the small hills of a true score, on
which derivatives end."""

TOLERANCE = 0.05
"""A derivative holds if it is off central differences of the true score by at most this part of
the gradient's length (in units of the parameters' ranges)."""

CHECKS_AT_START, CHECKS = 3, 1
"""Directions in which a derivative is compared with differences: its own, and at the start two
random ones as well. Each takes four scores."""

SMOOTHED = "smoothed"
"""Key of the smoothed score among an outcome's parts."""

GRADIENT_BY = "gradient_by"
"""Key of where the gradient comes from among an outcome's parts: `RAYS` or `DIFFERENCES`."""

RAYS, DIFFERENCES = "derivatives of rays", "differences of scores"


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
        if resolution < 16:
            raise SearchError(f"a resolution of {resolution} is too coarse for gradients")
        if starts < 1:
            raise SearchError(f"there are {starts} starts", hint="Give 1 or more")
        self.resolution, self.memory = int(resolution), int(memory)
        self._starts = _starts(problem, int(starts))
        self.parts = moving_parts(problem.space)
        self._known: dict[bytes, Outcome] = {}
        self._message = ""

    @classmethod
    def usual_budget(cls, space: BoundSpace) -> int:
        """Enough to converge, as a rule, however many parameters there are."""
        return USUAL_BUDGET

    def evaluator(self, usual: DesignEvaluator) -> Evaluator:
        """Scores and slopes."""
        return SlopeEvaluator(usual, self.parts, self.objective, self.resolution)

    def ask(self) -> FloatArray:
        """The next point (1, n) that L-BFGS-B wants to know of; none when all ascents have
        converged.
        """
        space = self.space
        for start in self._starts:
            point = self._ascend((start - space.lower) / (space.upper - space.lower))
            if point is not None:
                return point[None]
        return np.empty((0, space.size))

    def _ascend(self, start: FloatArray) -> FloatArray | None:
        """The next point (n,) that an ascent from a point (n,), as parts of the ranges, wants to
        know of; None when it has converged.
        """
        from scipy.optimize import minimize

        space = self.space
        span = space.upper - space.lower

        def downhill(unit: FloatArray) -> tuple[float, FloatArray]:
            point = np.clip(space.lower + unit * span, space.lower, space.upper)
            outcome = self._known.get(point.tobytes())
            if outcome is None:
                raise _PointWantedError(point)
            if outcome.gradient is None:
                return self._worst(), np.zeros_like(unit)  # forbidden: a shorter step is tried
            return -_smoothed(outcome, self.objective), -outcome.gradient * span

        options = {"maxcor": self.memory, "ftol": CONVERGED, "maxiter": 10_000, "maxfun": 100_000}
        try:
            found = minimize(
                downhill,
                start,
                jac=True,
                method="L-BFGS-B",
                bounds=[(0.0, 1.0)] * space.size,
                options=options,
            )
        except _PointWantedError as wanted:
            return wanted.point
        self._message = str(found.message)
        return None

    def tell(self, vectors: FloatArray, outcomes: Sequence[Outcome]) -> None:
        """Remember slopes by their points."""
        for vector, outcome in zip(vectors, outcomes, strict=True):
            self._known[np.asarray(vector, dtype=np.float64).tobytes()] = outcome

    def describe(self) -> dict[str, Any]:
        """How many gradients are known, how many of them come from differences, and why the ascent
        ended.
        """
        found = [o for o in self._known.values() if o.gradient is not None]
        differences = sum(o.parts[self.objective][GRADIENT_BY] == DIFFERENCES for o in found)
        return {"slopes": len(found), "by_differences": differences, "ended": self._message}

    def notes(self) -> list[str]:
        """Where gradients are differences of scores, and why."""
        facts = self.describe()
        if not facts["by_differences"]:
            return []
        why = (
            f"with at most {FEW} parameters they cost no more than derivatives of rays"
            if self.space.size <= FEW
            else f"derivatives of rays are more than {TOLERANCE:.0%} off there, or there are none"
        )
        return [
            f"the gradients at {facts['by_differences']} of {facts['slopes']} points are "
            f"differences of scores: {why}"
        ]

    def _worst(self) -> float:
        values = [_smoothed(o, self.objective) for o in self._known.values() if not o.failed]
        return 1.0 - min(values, default=0.0)


class SlopeEvaluator:
    """Scores a point as usual, and adds the smoothed score and its gradient."""

    def __init__(
        self, usual: DesignEvaluator, parts: list[str], objective: str, resolution: int
    ) -> None:
        self.usual = usual
        self.parts = parts
        self.objective = objective
        self.resolution = resolution
        self._jacobian: Jacobian | None = None

    def __call__(self, vector: FloatArray, seed: int) -> Outcome:
        """See `Evaluator`."""
        outcome = self.usual(vector, seed)
        if outcome.failed:
            return outcome
        began = time.perf_counter()
        try:
            value, gradient, source = self.checked_slope(vector, seed)
        except OptiSenseError as error:
            return self.usual.failed(str(error), began)
        parts = dict(outcome.parts)
        facts = {SMOOTHED: value, GRADIENT_BY: source}
        parts[self.objective] = {**parts.get(self.objective, {}), **facts}
        seconds = outcome.seconds + time.perf_counter() - began
        return Outcome(outcome.scores, None, parts, seconds, gradient)

    def checked_slope(self, vector: FloatArray, seed: int) -> tuple[float, FloatArray, str]:
        """The smoothed score at a point (n,), its gradient (n,) by the coordinates, and where that
        comes from: `RAYS`, or `DIFFERENCES` where the derivatives of rays do not hold.

        Raises:
            OptiSenseError: the design can't be built, or no ray arrives.
        """
        if self.usual.space.size <= FEW:
            return self._smoothed(vector), self.differences(vector, seed), DIFFERENCES
        try:
            slopes, gradient = self.slope(vector)
        except NoDerivativeError:
            return self._smoothed(vector), self.differences(vector, seed), DIFFERENCES
        if self.holds(vector, gradient, seed):
            return slopes.value, gradient, RAYS
        return slopes.value, self.differences(vector, seed), DIFFERENCES

    def slope(self, vector: FloatArray) -> tuple[Slopes, FloatArray]:
        """The smoothed score at a point (n,), and its gradient (n,) by derivatives of rays.

        Raises:
            NoDerivativeError: a part moves by which rays have no derivative.
            OptiSenseError: the design can't be built, or no ray arrives.
        """
        space = self.usual.space
        design = space.apply(vector)
        rays = self._rays(design, self.parts)
        slopes = SMOOTH[self.objective](rays, **self._settings())
        back = rays.pull_back(slopes.cosine, slopes.weight, slopes.points)
        # The Jacobian of the start serves all points where shapes move linearly. It may not be
        # that of whichever point came first: a study that is resumed would differ in rounding.
        if self._jacobian is None:
            self._jacobian = jacobian(space, space.start, self.parts)
        moves = self._jacobian
        if not holds(moves, space, design, vector):
            moves = jacobian(space, np.array(vector, dtype=np.float64), self.parts)
        gradient = moves.camera @ back.camera
        for name, slope in moves.parts.items():
            gradient = gradient + np.tensordot(slope, back.parts[name], axes=2)
        return slopes, gradient

    def holds(self, vector: FloatArray, gradient: FloatArray, seed: int) -> bool:
        """Whether a gradient (n,) agrees with central differences of the true score along ways
        that the bounds leave open.

        Differences over one step and over half of it that disagree with each other excuse as much:
        where the score itself steps there is little to compare with.
        """
        space = self.usual.space
        span = space.upper - space.lower
        blocked = (gradient > 0) & (vector >= space.upper) | (gradient < 0) & (
            vector <= space.lower
        )
        scaled = np.where(blocked, 0.0, gradient * span)
        length = float(np.linalg.norm(scaled))
        at_start = np.array_equal(vector, space.start)
        random = np.random.default_rng(zlib.crc32(np.asarray(vector, dtype="<f8").tobytes()))
        ways = [scaled / length] if length > 0 else []
        while len(ways) < (CHECKS_AT_START if at_start else CHECKS) and not blocked.all():
            way = np.where(blocked, 0.0, random.normal(size=space.size))
            ways.append(way / np.linalg.norm(way))
        for way in ways:
            far, near = (self._difference(vector, way * span, h, seed) for h in (STEP, STEP / 2))
            if far is None or near is None:
                continue
            allowed = TOLERANCE * max(length, abs(near)) + abs(far - near)
            if abs(float(way @ scaled) - near) > allowed:
                return False
        return True

    def differences(self, vector: FloatArray, seed: int) -> FloatArray:
        """(n,) gradient of the true score at a point (n,) by central differences over `STEP`; 0
        for coordinates by which there is no score on one of the sides.
        """
        space = self.usual.space
        gradient = np.zeros(space.size)
        for number, span in enumerate(space.upper - space.lower):
            way = np.zeros(space.size)
            way[number] = span
            found = self._difference(vector, way, STEP, seed)
            gradient[number] = 0.0 if found is None else found / span
        return gradient

    def _difference(
        self, vector: FloatArray, way: FloatArray, step: float, seed: int
    ) -> float | None:
        """How the true score changes along `way` (n,), for a whole one, over `step` of it to both
        sides, or as far as the bounds allow; None if that is less than half of a step in all, or
        if there is no score on one of the sides.
        """
        space = self.usual.space
        room = [_room(space, vector, side * way, step) for side in (1.0, -1.0)]
        if sum(room) < step / 2:
            return None
        found = []
        for side in (room[0], -room[1]):
            point = np.clip(vector + side * way, space.lower, space.upper)
            try:
                score = self.usual.objective_scores(space.apply(point), seed)[self.objective]
            except OptiSenseError:
                return None
            if score.failure is not None:
                return None
            found.append(score.value)
        return (found[0] - found[1]) / sum(room)

    def _smoothed(self, vector: FloatArray) -> float:
        rays = self._rays(self.usual.space.apply(vector), ())
        return SMOOTH[self.objective](rays, **self._settings()).value

    def _rays(self, design: SensorDesign, moving: Sequence[str]) -> DifferentiableRays:
        width, height = design.camera.resolution
        size = self.resolution, max(1, round(self.resolution * height / width))
        return self.usual.keeper.model(design).differentiable_rays(moving, size)

    def _settings(self) -> dict[str, Any]:
        """The objective's own settings that its smoothed form knows too."""
        known = signature(SMOOTH[self.objective]).parameters
        return {name: value for name, value in self.usual.settings.items() if name in known}

    def __getstate__(self) -> dict[str, object]:
        return {**self.__dict__, "_jacobian": None}


class _PointWantedError(Exception):
    """Ends a run of the optimiser at a point whose slope is not known yet."""

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


def _room(space: BoundSpace, vector: FloatArray, way: FloatArray, most: float) -> float:
    """How often `way` (n,), at most so often, fits between a point (n,) and the bounds."""
    ahead = np.where(way > 0, space.upper - vector, vector - space.lower)
    moving = way != 0
    return float(np.min(ahead[moving] / np.abs(way[moving]), initial=most).clip(0.0))


def _smoothed(outcome: Outcome, objective: str) -> float:
    return float(outcome.parts[objective][SMOOTHED])
