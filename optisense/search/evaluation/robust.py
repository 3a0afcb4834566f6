"""Robust scores: the score that nine of ten manufactured sensors reach."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from optisense.array_types import FloatArray
from optisense.errors import OptiSenseError, UnknownPartError
from optisense.json_values import json_ready
from optisense.objectives.evaluation import ProgressCallback
from optisense.objectives.registry import CONDITIONS
from optisense.search.evaluation.evaluator import DesignEvaluator
from optisense.search.evaluation.outcome import Outcome
from optisense.search.evaluation.requirements import Requirement
from optisense.search.space.constraints import why_forbidden
from optisense.search.space.manufacturing import (
    SAMPLES,
    BoundManufacturingErrors,
    ManufacturingErrors,
    latin_hypercube,
)

PERCENTILES = {"p10": 0.1, "p50": 0.5, "p90": 0.9}
"""Quantiles of the scores of manufactured sensors: P10, which is the robust score, as nine of ten
sensors reach it, and P50 and P90, which are reported beside it.
"""


class RobustEvaluator:
    """Evaluator that scores a point by the tenth percentile (P10) over sensors with manufacturing
    errors.

    A condition is met if nine of ten such sensors meet it.

    All points are scored with the same errors, so that they are compared fairly.
    """

    def __init__(
        self, usual: DesignEvaluator, errors: ManufacturingErrors, seed: int, samples: int = SAMPLES
    ) -> None:
        """Draw the errors."""
        self.usual = usual
        self.errors = errors
        self.renders = usual.renders
        self.seed = seed
        self.samples = samples
        self._drawn: dict[int, FloatArray] = {}
        self._errors(errors.bind(usual.space.prepared))

    def report_progress_to(self, callback: ProgressCallback) -> None:
        """See `DesignEvaluator.report_progress_to`."""
        self.usual.report_progress_to(callback)

    def __call__(self, vector: FloatArray, seed: int) -> Outcome:
        """See `optisense.search.evaluation.evaluator.Evaluator`."""
        began = time.perf_counter()
        try:
            design = self.usual.space.apply(vector)
            reason = why_forbidden(design, self.usual.kept)
            bound = self.errors.bind(design)
        except OptiSenseError as error:
            reason = str(error)
        if reason is not None:
            return self.usual.failed(reason, began)
        found = []
        for errors in self._errors(bound):
            try:
                found.append(self.usual.evaluate(bound.apply(errors), seed))
            except UnknownPartError:
                raise
            except OptiSenseError as error:
                found.append(self.usual.failed(str(error), began))
        scores, parts = {}, {}
        for name in self.usual.names:
            values = [outcome.scores.get(name, math.nan) for outcome in found]
            several = {key: percentile(values, share) for key, share in PERCENTILES.items()}
            scores[name] = several["p10"]
            parts[name] = json_ready({**several, "samples": values})
        if self.usual.requirements:
            parts[CONDITIONS] = {
                str(each): json_ready(_reached(each, found)) for each in self.usual.requirements
            }
        outcome = Outcome(scores, None, parts, time.perf_counter() - began)
        if not outcome.unmeasured:
            return outcome
        reasons = [each.failure for each in found if each.failure]
        failure = f"{len(reasons)} of {len(found)} manufactured sensors fail: {reasons[0]}"
        return replace(outcome, failure=failure)

    def _errors(self, bound: BoundManufacturingErrors) -> FloatArray:
        """Return the errors (samples, d), the same for designs with as many erroneous values."""
        if bound.size not in self._drawn:
            shares = latin_hypercube(self.samples, bound.size, self.seed)
            self._drawn[bound.size] = bound.errors(shares)
        return self._drawn[bound.size]


def _reached(wanted: Requirement, found: Sequence[Outcome]) -> float:
    """Return the value of a limited quantity that nine of ten manufactured sensors reach: P10 for a
    lower limit, P90 for an upper one; NaN if it falls among sensors without a value.
    """
    measured = [outcome.conditions.get(str(wanted)) for outcome in found]
    values = np.array([math.nan if value is None else value for value in measured])
    low = PERCENTILES["p10"]
    return percentile(values, low) if wanted.at_least else -percentile(-values, low)


def percentile(values: ArrayLike, share: float) -> float:
    """Return a percentile, as a share 0 to 1, of values (k,), with linear interpolation between
    neighbours. Failed values (NaN) count as lower than any other; the result is NaN if the
    percentile falls among them.
    """
    ordered = np.sort(np.nan_to_num(np.asarray(values, dtype=np.float64), nan=-np.inf))
    place = share * (len(ordered) - 1)
    low, high = ordered[math.floor(place)], ordered[math.ceil(place)]
    if not math.isfinite(low):
        return math.nan
    return float(low + (place - math.floor(place)) * (high - low))
