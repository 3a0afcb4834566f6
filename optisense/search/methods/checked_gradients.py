"""Smoothed score of a point and its gradient, by ray derivatives that are compared with finite
differences of the true score, or by these differences.

A derivative is valid if it agrees with central differences of the true score, and these agree with
each other for two step sizes. A score can fail this in two ways. If its differences agree with each
other but not with the derivative, the gradient is made of differences. If its differences change
with their step size, the score has a jump, because a row of pixels or of AOAP's triangles comes
into view at once, or a kink, and no derivative describes it. The outcome tells the two apart.
"""

from __future__ import annotations

import time
import zlib
from collections.abc import Iterator, Sequence
from enum import Enum
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from optisense.array_types import FloatArray
from optisense.design import SensorDesign
from optisense.errors import NoDerivativeError, OptiSenseError
from optisense.search.evaluation.evaluator import DesignEvaluator
from optisense.search.evaluation.outcome import Outcome
from optisense.search.methods._jacobian import Jacobian, jacobian, predicts
from optisense.search.methods._smooth_scores import SmoothScore
from optisense.search.methods.score_differences import STEP, GradientSource, ScoreDifferences
from optisense.search.space.pickling import PickledWithoutCaches

if TYPE_CHECKING:
    from optisense.optics.transport.ray_gradient import DifferentiableRays

FEW_PARAMETERS = 8
"""Largest number of parameters for which central differences need no more scores than ray
derivatives with their check; they also see past the small hills of a true score."""

TOLERANCE = 0.05
"""Relative tolerance of the check of a derivative along a direction. It refers to the difference of
the true score or, if that is smaller, to the slope of an average random direction."""

CHECKS_AT_START, CHECKS = 4, 1
"""Number of directions in which a gradient is compared with differences, at the start and
elsewhere: that of the gradient, and at the start three random ones as well, which show errors that
the steepest direction hides. Ray derivatives that no difference contradicts at the start are not
compared elsewhere, which would take more time than the search and lead no higher.
"""

SMOOTHED = "smoothed"
"""Key of the smoothed score in an outcome's parts."""

LIMITED = "smoothed_limited"
"""Key of the smoothed limited quantities, in the order of conditions, in an outcome's parts."""

GRADIENT_BY = "gradient_by"
"""Key of the source of the gradient in an outcome's parts."""

GRADIENT_HOLDS = "gradient_holds"
"""Key in an outcome's parts of whether the gradient agrees with differences of the true score over
two steps. If it does not, the score has no derivative at this scale.
"""


class Agreement(Enum):
    """Agreement of a gradient with central differences of the true score."""

    HOLDS = "agrees with differences over both steps"
    DIFFERS = "differences over both steps agree with each other, the gradient is another one"
    UNSTEADY = "differences over the two steps disagree: the score steps or has a kink"


class CheckedGradient(NamedTuple):
    """Values and gradients at a point: the smoothed score and limited quantities, (1 + m,), exact
    where there is no smooth form; their gradients by the coordinates, (1 + m, n); the source of
    these; and whether that of the score passed the check, None if it was not checked.
    """

    values: FloatArray
    gradients: FloatArray
    source: GradientSource
    holds: bool | None


class _Check(NamedTuple):
    """Direction `way` (n,), in units of the parameters' ranges, in which a gradient is checked; its
    slope along that direction, and the slope of an average random direction.
    """

    way: FloatArray
    slope: float
    typical: float


class GradientEvaluator(PickledWithoutCaches):
    """Evaluator that scores a point as usual, and adds the smoothed values and gradients of the
    score and of the quantities that conditions limit.
    """

    def __init__(
        self,
        usual: DesignEvaluator,
        parts: list[str],
        objective: str,
        resolution: int,
        seed: int,
        layers: bool = False,
    ) -> None:
        """Store the settings; nothing is traced yet. Points move `parts`, `resolution` rays are
        traced across the image, and only trials with the seed of the search get gradients. With
        `layers`, `usual` relights layers and all gradients are differences.
        """
        self.usual = usual
        self.parts = parts
        self.objective = objective
        self.resolution = resolution
        self.seed = seed
        self.layers = layers
        limited = [each.objective().name for each in usual.requirements]
        self.wanted = [objective, *limited]
        smooth = [None if layers else SmoothScore.of(name) for name in self.wanted]
        self._smooth = {k: each for k, each in enumerate(smooth) if each is not None}
        self._rough = [k for k, each in enumerate(smooth) if each is None]
        self._rough_names = [self.wanted[k] for k in self._rough]
        self._differences = ScoreDifferences(usual)
        self._contradicted: bool | None = None

    def __call__(self, vector: FloatArray, seed: int) -> Outcome:
        """See `Evaluator`."""
        outcome = self.usual(vector, seed)
        wanted = {self.objective, *outcome.conditions}
        if not wanted.isdisjoint(outcome.unmeasured) or seed != self.seed:
            return outcome
        began = time.perf_counter()
        try:
            found = self.checked_gradient(vector, seed)
        except OptiSenseError as error:
            return self.usual.failed(str(error), began)
        parts = dict(outcome.parts)
        facts: dict[str, Any] = {SMOOTHED: float(found.values[0]), GRADIENT_BY: found.source.value}
        if len(found.values) > 1:
            facts[LIMITED] = found.values[1:].tolist()
        if found.holds is not None:
            facts[GRADIENT_HOLDS] = found.holds
        parts[self.objective] = {**parts.get(self.objective, {}), **facts}
        seconds = outcome.seconds + time.perf_counter() - began
        return Outcome(outcome.scores, outcome.failure, parts, seconds, found.gradients.ravel())

    def checked_gradient(self, vector: FloatArray, seed: int) -> CheckedGradient:
        """Return the smoothed score at a point (n,), and a gradient that has been compared with the
        score. Ray derivatives are used unless differences of the score that agree with each other
        contradict them: where the differences do not agree, ray derivatives are as good as any, and
        cost less. If none contradicts them at the start, they are trusted everywhere. The
        quantities that conditions limit are differentiated in the same way, without a check.
        """
        if self.layers:
            gradients = self._differences.gradients(vector, seed, self.wanted)
            return CheckedGradient(
                self._values(vector, seed), gradients, GradientSource.LAYERS, None
            )
        if self.usual.space.size > FEW_PARAMETERS:
            try:
                return self._by_rays(vector, seed)
            except (NoDerivativeError, _ContradictedError):
                pass
        gradients = self._differences.gradients(vector, seed, self.wanted)
        steady = self.steady(vector, gradients[0], seed)
        values = self._values(vector, seed)
        return CheckedGradient(values, gradients, GradientSource.DIFFERENCES, steady)

    def _by_rays(self, vector: FloatArray, seed: int) -> CheckedGradient:
        """Return the smoothed values at a point (n,) and their gradients by ray derivatives, or by
        differences for quantities without a smooth form; _ContradictedError if differences of the
        true score contradict them.
        """
        values, gradients = self._slopes(vector)
        holds = None
        at_start = np.array_equal(vector, self.usual.space.start)
        if at_start or self._contradicted_at_start(seed):
            found = self.agreement(vector, gradients[0], seed)
            if at_start:
                self._contradicted = found is Agreement.DIFFERS
            if found is Agreement.DIFFERS:
                raise _ContradictedError
            holds = found is Agreement.HOLDS
        if self._rough:
            gradients[self._rough] = self._differences.gradients(vector, seed, self._rough_names)
            design = self.usual.space.apply(vector)
            values[self._rough] = self._differences.exact(design, seed, self._rough_names)
        return CheckedGradient(values, gradients, GradientSource.RAYS, holds)

    def _contradicted_at_start(self, seed: int) -> bool:
        """Return whether differences contradict ray derivatives at the start; computed once."""
        if self._contradicted is None:
            start = self.usual.space.start
            try:
                _, gradient = self.gradient(start)
            except OptiSenseError:  # the check is impossible here, so every point is checked
                self._contradicted = True
            else:
                self._contradicted = self.agreement(start, gradient, seed) is Agreement.DIFFERS
        return self._contradicted

    def gradient(self, vector: FloatArray) -> tuple[float, FloatArray]:
        """Return the smoothed score at a point (n,), and its gradient (n,) by ray derivatives;
        NoDerivativeError if these are not defined for a part that moves.
        """
        values, gradients = self._slopes(vector)
        return float(values[0]), gradients[0]

    def _slopes(self, vector: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the smoothed values (1 + m,) at a point, and their gradients (1 + m, n) by ray
        derivatives; NaN for quantities without a smooth form.
        """
        space = self.usual.space
        design = space.apply(vector)
        rays = self._rays(design, self.parts)
        # The Jacobian of the start serves all points where shapes move linearly. It may not be
        # that of whichever point came first: a study that is resumed would differ in rounding.
        moves = self._jacobian
        if not predicts(moves, space, design, vector):
            moves = jacobian(space, np.array(vector, dtype=np.float64), self.parts)
        values = np.full(len(self.wanted), np.nan)
        gradients = np.full((len(self.wanted), space.size), np.nan)
        for number, smooth in self._smooth.items():
            slopes = smooth.slopes(rays, self.usual.settings)
            back = rays.pull_back(slopes.cosine, slopes.weight, slopes.points)
            gradient = moves.camera @ back.camera
            for name, slope in moves.parts.items():
                gradient = gradient + np.tensordot(slope, back.parts[name], axes=2)
            values[number], gradients[number] = slopes.value, gradient
        return values, gradients

    def agreement(self, vector: FloatArray, gradient: FloatArray, seed: int) -> Agreement:
        """Compare a gradient (n,) with central differences of the true score over `STEP` and half
        of it, along directions that the bounds leave free.
        """
        found = Agreement.HOLDS
        for check in self._checks(vector, gradient):
            far, near = (self.difference(vector, check.way, h, seed) for h in (STEP, STEP / 2))
            if far is None or near is None:
                continue
            allowed = TOLERANCE * max(abs(near), check.typical)
            if abs(far - near) > allowed:
                found = Agreement.UNSTEADY
            elif abs(check.slope - near) > allowed:
                return Agreement.DIFFERS
        return found

    def steady(self, vector: FloatArray, gradient: FloatArray, seed: int) -> bool:
        """Return whether a gradient (n,) of differences over `STEP` agrees with that over half."""
        for check in self._checks(vector, gradient):
            near = self.difference(vector, check.way, STEP / 2, seed)
            if near is None:
                continue
            if abs(check.slope - near) > TOLERANCE * max(abs(near), check.typical):
                return False
        return True

    def _checks(self, vector: FloatArray, gradient: FloatArray) -> Iterator[_Check]:
        """Yield the directions in which a gradient (n,) is compared with the score."""
        space = self.usual.space
        blocked = (gradient > 0) & (vector >= space.upper) | (gradient < 0) & (
            vector <= space.lower
        )
        if blocked.all():
            return
        scaled = np.where(blocked, 0.0, gradient * space.span)
        length = float(np.linalg.norm(scaled))
        at_start = np.array_equal(vector, space.start)
        random = np.random.default_rng(zlib.crc32(np.asarray(vector, dtype="<f8").tobytes()))
        ways = [scaled / length] if length > 0 else []
        while len(ways) < (CHECKS_AT_START if at_start else CHECKS):
            way = np.where(blocked, 0.0, random.normal(size=space.size))
            ways.append(way / np.linalg.norm(way))
        typical = length / float(np.sqrt(np.count_nonzero(~blocked)))
        for way in ways:
            yield _Check(way * space.span, float(way @ scaled), typical)

    def difference(
        self, vector: FloatArray, way: FloatArray, step: float, seed: int
    ) -> float | None:
        """Return the derivative of the true score along `way`; see `ScoreDifferences.along`."""
        found = self._differences.along(vector, way, step, seed, self.wanted[:1])
        return None if found is None else float(found[0])

    def _values(self, vector: FloatArray, seed: int) -> FloatArray:
        """Return the smoothed values (1 + m,) at a point, or exact ones without a smooth form."""
        design = self.usual.space.apply(vector)
        values = np.full(len(self.wanted), np.nan)
        if self._smooth:
            rays = self._rays(design, ())
            for number, smooth in self._smooth.items():
                values[number] = smooth.slopes(rays, self.usual.settings).value
        if self._rough:
            values[self._rough] = self._differences.exact(design, seed, self._rough_names)
        return values

    def _rays(self, design: SensorDesign, moving: Sequence[str]) -> DifferentiableRays:
        size = design.camera.size_at(self.resolution)
        return self.usual.models.model(design).differentiable_rays(moving, size)

    @cached_property
    def _jacobian(self) -> Jacobian:
        """Jacobian of the starting point."""
        space = self.usual.space
        return jacobian(space, space.start, self.parts)


class _ContradictedError(Exception):
    """Error: differences of the true score agree with each other and contradict ray derivatives."""
