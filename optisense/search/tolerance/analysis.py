"""Distribution of a design's score under manufacturing errors."""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from optisense.array_types import FloatArray
from optisense.design import SensorDesign
from optisense.errors import SearchError
from optisense.json_values import json_ready
from optisense.keyword_types import plain_numbers
from optisense.objectives.score import deviation_of
from optisense.search.evaluation.evaluator import DesignEvaluator, Goal, as_goals
from optisense.search.evaluation.outcome import Outcome
from optisense.search.evaluation.robust import PERCENTILES
from optisense.search.executors import Runner, Workers, create_runner
from optisense.search.executors.base import run_jobs
from optisense.search.space.manufacturing import ManufacturingErrors, ToleranceDistribution
from optisense.search.study.failures import cause_of
from optisense.search.study.rescoring import fresh_seeds
from optisense.search.study.settings import package_versions
from optisense.search.tolerance.sensitivity import (
    Estimate,
    paired_errors,
    percentile_of,
    total_effect,
)

SENSORS = 120
"""Default number of sensors with manufacturing errors. They render in about ten minutes, and shares
of five errors then have a standard error of up to 0.3 (docs/tolerance.md).
"""

LEAST_ROWS = 8
"""Smallest number of rows of sensors, twice the pairs that an estimate of a share needs; each row
is one sensor, and one more for each source of error.
"""

NOISE_SEEDS = 3
"""Number of seeds with which the nominal design is scored, to separate noise from tolerance."""

OWN_SCORES = 1 + NOISE_SEEDS
"""Number of scores of the nominal design, which come before those of manufactured sensors."""

MOST_NOISE_SHARE = 0.25
"""Share of the noise in the variance above which the shares of errors count as unknown: noise of
half the standard deviation adds as much to each share, whatever the error does."""

POSITION, ANGLE, SPECULARITY, CAGE_POINT, INDEX = 0.1, 2.0, 0.05, 0.05, 0.005
"""Default standard deviations of errors: of each light's position (mm) and direction (degrees about
each axis), of the specularity, of each coordinate of a control point (mm), and of a refractive
index. They are assumptions for a sensor that is built by hand: LEDs soldered to a board that is
glued in, a printed mould, silicone and resin of another batch.
"""

ToleranceCallback = Callable[[int, int, str], None]
"""Function that is called with the number of finished scores, the number of all, and the stage of
the current score, if it is computed in this process.
"""


@dataclass(frozen=True)
class ScoreDistribution:
    """Distribution of one objective's score.

    Attributes:
        nominal: score of the nominal design.
        noise: standard deviation of the nominal design's score over seeds; 0 if they don't matter.
        scores: scores (rows, k) of the sensors, NaN where one failed.
        percentiles: percentiles by name ("p10", ...).
        shares: share of each source of error in the variance, the largest first; None if too many
            sensors failed to tell.
    """

    nominal: float
    noise: float
    scores: FloatArray = field(repr=False)
    percentiles: Mapping[str, Estimate]
    shares: Mapping[str, Estimate | None]

    @property
    def deviation(self) -> float:
        """Standard deviation of the scores, without failed sensors; NaN for less than two."""
        known = self.scores[np.isfinite(self.scores)]
        return deviation_of(known.ravel().tolist())

    @property
    def noise_share(self) -> float:
        """Share of the variance that is due to the noise of the image; at most 1."""
        if not (self.noise > 0.0 and self.deviation > 0.0):
            return 0.0
        return min(1.0, (self.noise / self.deviation) ** 2)

    @property
    def caveat(self) -> str:
        """Text that says why the shares tell nothing; empty if they do."""
        if self.deviation == 0.0:
            return "the score does not depend on these errors"
        if self.noise_share > MOST_NOISE_SHARE:
            return (
                f"{100 * self.noise_share:.0f} % of the variance is noise of the image, so that "
                "the shares do not tell which error matters: use more photons"
            )
        return ""


@dataclass(frozen=True, eq=False)
class Tolerance:
    """Effect of manufacturing errors on a design.

    Attributes:
        design: nominal design.
        errors: manufacturing errors.
        results: distribution of the score by objective.
        sensors: number of sensors that were tried.
        seed: seed of the errors and of the light.
        failures: causes for which sensors have no score (see `failures.cause_of`), each with the
            number of sensors.
        interrupted: whether the analysis was stopped early.
        seconds: wall time, s.
        settings: settings of the objectives.
        values: values (rows, k, d) of the numbers with errors.
        names: names (d) of these numbers.
    """

    design: SensorDesign
    errors: ManufacturingErrors
    results: Mapping[str, ScoreDistribution]
    sensors: int
    seed: int
    failures: Mapping[str, int]
    interrupted: bool
    seconds: float
    settings: Mapping[str, Any]
    values: FloatArray = field(repr=False)
    names: Sequence[str] = field(repr=False)

    def to_dict(self) -> dict[str, Any]:
        """Return all results but the numbers with errors, ready for JSON."""
        values = {
            "design": self.design.name,
            "versions": package_versions(),
            "seed": self.seed,
            "errors": self.errors.to_plain(),
            "sensors": self.sensors,
            "interrupted": self.interrupted,
            "seconds": round(self.seconds, 2),
            "settings": dict(self.settings),
            "failures": dict(self.failures),
            "objectives": {name: _plain(each) for name, each in self.results.items()},
        }
        return plain_numbers(values)


def usual_errors(design: SensorDesign) -> ManufacturingErrors:
    """Return the default errors of a design."""
    found: dict[str, ToleranceDistribution | float] = {}
    if design.lights:
        found |= {"lights.position": POSITION, "lights.angle": ANGLE}
    found["coating.specularity"] = SPECULARITY
    found |= {f"cages.{name}.points": CAGE_POINT for name in design.cages}
    used = {part.material for part in design.parts.values()}
    for name, material in design.materials.items():
        index = getattr(material, "ior", 1.0)
        if name in used and index > 1.001:
            found[f"materials.{name}.ior"] = INDEX
    return ManufacturingErrors(found)


def tolerance(
    design: SensorDesign,
    objective: Goal | Sequence[Goal],
    errors: ManufacturingErrors | Mapping[str, ToleranceDistribution | float] | None = None,
    *,
    sensors: int = SENSORS,
    seed: int = 0,
    workers: Workers = 1,
    settings: Mapping[str, Any] | None = None,
    variant: str = "auto",
    progress: ToleranceCallback | None = None,
    on_wait: Callable[[], None] | None = None,
) -> Tolerance:
    """Score sensors with manufacturing errors, all with the same seed of the light.

    Args:
        design: nominal design.
        objective: one or several objectives; see `optisense.search.search`.
        errors: distributions by path (see `ManufacturingErrors`); `usual_errors` if None.
        sensors: approximate number of sensors; at least 8 for each source of error and 8 more.
        seed: seed of the errors and of the light.
        workers: where the sensors are scored; see `optisense.search.search`.
        settings: settings of the objectives.
        variant: variant of the renderer: "auto", "llvm" or "cuda".
        progress: function that is called a few times a second.
        on_wait: function that is called when Ctrl-C waits for a sensor in this process to finish.

    Returns:
        Percentiles of the scores, and each source's share in their variance. Ctrl-C ends it
        early with what is finished: shares need four rows of sensors (one sensor, and one more for
        each source of error), percentiles any sensor.

    Raises:
        KeyboardInterrupt: Ctrl-C came before the nominal design had its score.
        SearchError: an error is invalid, or the nominal design has no score by one of the
            objectives.
        DesignError: a path names nothing in the design; the message suggests a similar name.
        ObjectiveError: an objective or a setting is unknown.
    """
    began = time.perf_counter()
    if errors is None:
        making = usual_errors(design)
    else:
        making = errors if isinstance(errors, ManufacturingErrors) else ManufacturingErrors(errors)
    bound = making.bind(design)
    goals = as_goals(objective)
    evaluator = DesignEvaluator(bound.space, goals, settings, keeps=False, variant=variant)
    count = 1 if len(making.sources) == 1 else 1 + len(making.sources)
    rows = max(LEAST_ROWS, round(sensors / count))
    points = bound.points(paired_errors(bound, rows, seed))
    nominal = bound.points(np.zeros(bound.size))
    jobs = [(nominal, each) for each in (seed, *fresh_seeds(seed, NOISE_SEEDS))]
    jobs += [(point, seed) for point in points.reshape(-1, bound.size)]
    with create_runner(evaluator, workers, on_wait) as runner:
        found, interrupted = _work(runner, jobs, progress or (lambda done, of, doing: None))
    itself, again, tried = found[:1], found[1:OWN_SCORES], found[OWN_SCORES:]
    whole = len([each for each in tried if each is not None]) // count
    if itself[0] is None:
        raise KeyboardInterrupt
    if itself[0].failed:
        raise SearchError(f"the nominal design has no score: {itself[0].failure}")
    if whole > 0:
        outcomes = [each for each in tried[: whole * count] if each is not None]
        shape = whole, count
    else:  # not even one row: sensors by themselves
        outcomes = [each for each in tried if each is not None]
        shape = len(outcomes), 1
        finished = [number for number, each in enumerate(tried) if each is not None]
        points = points.reshape(-1, 1, bound.size)[finished]
    repeats = [itself[0], *(each for each in again if each is not None)]
    return Tolerance(
        design=design,
        errors=making,
        results={
            name: _score_distribution(name, repeats, outcomes, making.sources, shape)
            for name in evaluator.names
        },
        sensors=len(outcomes),
        seed=seed,
        failures=Counter(cause_of(each.failure) for each in outcomes if each.failure is not None),
        interrupted=interrupted,
        seconds=time.perf_counter() - began,
        settings=evaluator.settings,
        values=points[: shape[0]],
        names=bound.space.names,
    )


def _score_distribution(
    name: str,
    repeats: Sequence[Outcome],
    outcomes: Sequence[Outcome],
    sources: Sequence[str],
    shape: tuple[int, int],
) -> ScoreDistribution:
    values = np.array([each.scores.get(name, math.nan) for each in outcomes]).reshape(shape)
    same = np.array([each.scores.get(name, math.nan) for each in repeats])
    rows_are_whole = shape[1] > 1 or len(sources) == 1
    shares = {
        source: total_effect(values, number) if rows_are_whole and shape[0] else None
        for number, source in enumerate(sources)
    }
    largest_first = sorted(
        shares.items(), key=lambda each: -1.0 if each[1] is None else each[1].value, reverse=True
    )
    return ScoreDistribution(
        nominal=float(same[0]),
        noise=deviation_of(same[np.isfinite(same)].tolist()),
        scores=values,
        percentiles={key: percentile_of(values, share) for key, share in PERCENTILES.items()},
        shares=dict(largest_first),
    )


def _work(
    runner: Runner,
    jobs: Sequence[tuple[FloatArray, int]],
    progress: ToleranceCallback,
) -> tuple[list[Outcome | None], bool]:
    """Return the outcome of each job, None for jobs after Ctrl-C, and whether it was pressed."""
    found: list[Outcome | None] = [None] * len(jobs)
    done = 0

    def finished(number: int, outcome: Outcome) -> None:
        nonlocal done
        found[number] = outcome
        done += 1
        progress(done, len(jobs), "")

    progress(0, len(jobs), "")
    runner.report_progress_to(lambda part, doing: progress(done, len(jobs), doing))
    try:
        run_jobs(runner, [(number, *job) for number, job in enumerate(jobs)], finished)
    except KeyboardInterrupt:
        return found, True
    return found, False


def _plain(each: ScoreDistribution) -> dict[str, Any]:
    plain: dict[str, Any] = json_ready(
        {
            "nominal": each.nominal,
            "noise": each.noise,
            "standard_deviation": each.deviation,
            "percentiles": {key: asdict(value) for key, value in each.percentiles.items()},
            "shares": {
                source: None if value is None else asdict(value)
                for source, value in each.shares.items()
            },
            "scores": each.scores.ravel(),
        }
    )
    return plain
