"""Gradient ascent for scores that chief rays decide, on shapes of mirrors and on the camera.

Quasi-Newton steps within bounds (L-BFGS-B: Byrd, Lu, Nocedal and Zhu, "A limited memory algorithm
for bound constrained optimization", SIAM J. Sci. Comput. 16, 1995), on a smoothed form of the
score (`optisense.objectives.smooth`) whose derivatives come from retracing the rays. The scores
that are stored are the true ones.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

import numpy as np

from optisense.errors import OptiSenseError, SearchError
from optisense.objectives.smooth import SMOOTH, Slopes
from optisense.search.evaluation import DesignEvaluator, Evaluator
from optisense.search.jacobian import Jacobian, holds, jacobian, moving_parts
from optisense.search.methods.base import FloatArray, Method, Problem
from optisense.search.outcome import Outcome
from optisense.search.space import BoundSpace

USUAL_BUDGET = 40
FADE = 0.015
"""Of the sensing surface's longest side: rays fade within so much of open edges. About two rays of
`resolution`: wider, the smoothed score leads away from the true one; on GelSight Svelte's mirror
four rays' width ends at an AOAP of 0.742, and this at 0.760."""

SMOOTHED = "smoothed"
"""Key of the smoothed score among an outcome's parts."""


class Gradient(Method):
    """L-BFGS-B from the design as it is."""

    name = "gradient"
    summary = "steepest way up by derivatives, for chief-ray scores of mirrors and cameras"

    def __init__(
        self,
        problem: Problem,
        *,
        fade: float | None = None,
        resolution: int = 160,
        memory: int = 10,
    ) -> None:
        """Check that there is a gradient.

        Args:
            problem: what to search; its first objective is aoap or 2to3pw.
            fade: mm; within so much of open edges of mirrors and of the sensing surface rays
                count less and less; 1.5 % of the sensing surface's length if None. Wider sees
                farther, narrower is nearer to the true score.
            resolution: rays across the image for gradients.
            memory: how many steps the quasi-Newton method remembers.

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
        if fade is not None and not fade > 0:
            raise SearchError(f"fade is {fade}", hint="Give a length in mm above 0")
        if resolution < 16:
            raise SearchError(f"a resolution of {resolution} is too coarse for gradients")
        self.fade, self.resolution, self.memory = fade, int(resolution), int(memory)
        self.parts = moving_parts(problem.space)
        self._known: dict[bytes, Outcome] = {}
        self._message = ""

    @classmethod
    def usual_budget(cls, space: BoundSpace) -> int:
        """Enough to converge, as a rule, however many parameters there are."""
        return USUAL_BUDGET

    def evaluator(self, usual: DesignEvaluator) -> Evaluator:
        """Scores and slopes."""
        return SlopeEvaluator(usual, self.parts, self.objective, self.fade, self.resolution)

    def ask(self) -> FloatArray:
        """The next point (1, n) that L-BFGS-B wants to know of; none when it has converged."""
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

        try:
            found = minimize(
                downhill,
                (space.start - space.lower) / span,
                jac=True,
                method="L-BFGS-B",
                bounds=[(0.0, 1.0)] * space.size,
                options={"maxcor": self.memory, "maxiter": 10_000, "maxfun": 100_000},
            )
        except _PointWantedError as wanted:
            return wanted.point[None]
        self._message = str(found.message)
        return np.empty((0, space.size))

    def tell(self, vectors: FloatArray, outcomes: Sequence[Outcome]) -> None:
        """Remember slopes by their points."""
        for vector, outcome in zip(vectors, outcomes, strict=True):
            self._known[np.asarray(vector, dtype=np.float64).tobytes()] = outcome

    def describe(self) -> dict[str, Any]:
        """How many slopes are known, and why the ascent ended."""
        return {"slopes": len(self._known), "ended": self._message}

    def _worst(self) -> float:
        values = [_smoothed(o, self.objective) for o in self._known.values() if not o.failed]
        return 1.0 - min(values, default=0.0)


class SlopeEvaluator:
    """Scores a point as usual, and adds the smoothed score and its gradient."""

    def __init__(
        self,
        usual: DesignEvaluator,
        parts: list[str],
        objective: str,
        fade: float | None,
        resolution: int,
    ) -> None:
        self.usual = usual
        self.parts = parts
        self.objective = objective
        self.fade = fade
        self.resolution = resolution
        self._jacobian: Jacobian | None = None

    def __call__(self, vector: FloatArray, seed: int) -> Outcome:
        """See `Evaluator`."""
        outcome = self.usual(vector, seed)
        if outcome.failed:
            return outcome
        began = time.perf_counter()
        try:
            slopes, gradient = self.slope(vector)
        except OptiSenseError as error:
            return self.usual.failed(str(error), began)
        parts = dict(outcome.parts)
        parts[self.objective] = {**parts.get(self.objective, {}), SMOOTHED: slopes.value}
        seconds = outcome.seconds + time.perf_counter() - began
        return Outcome(outcome.scores, None, parts, seconds, gradient)

    def slope(self, vector: FloatArray) -> tuple[Slopes, FloatArray]:
        """The smoothed score at a point (n,), and its gradient (n,) by the coordinates.

        Raises:
            OptiSenseError: the design can't be built, or no ray arrives.
        """
        space = self.usual.space
        design = space.apply(vector)
        model = self.usual.keeper.model(design)
        width, height = design.camera.resolution
        size = self.resolution, max(1, round(self.resolution * height / width))
        rays = model.differentiable_rays(self.parts, size)
        slopes = SMOOTH[self.objective](rays)
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

    def __getstate__(self) -> dict[str, object]:
        return {**self.__dict__, "_jacobian": None}


class _PointWantedError(Exception):
    """Ends a run of the optimiser at a point whose slope is not known yet."""

    def __init__(self, point: FloatArray) -> None:
        super().__init__()
        self.point = point


def _smoothed(outcome: Outcome, objective: str) -> float:
    return float(outcome.parts[objective][SMOOTHED])
