"""Trials per second of two worker processes, of one, and of one with all threads.

Counted from when each worker has built its model and compiled, as in a study of many trials. Next
to the wall time stands the processor time of a trial in its worker, which tells what two workers
take from each other even on a machine that does something else.
"""

from __future__ import annotations

import time
from collections import defaultdict
from dataclasses import replace
from typing import Any

import numpy as np

import optisense
from optisense.design import SensorDesign
from optisense.search import Outcome, Plan, SearchSpace, Study
from optisense.search.evaluation.evaluator import Evaluator
from optisense.search.executors import ProcessPool, Runner
from optisense.search.executors.pool import processors
from optisense.search.study.loop import StudyRun
from optisense.search.study.store import Row

BLEND = {"cages.M1.blend": (0.0, 1.0)}
"""Range between the flat and the most curved mirror, in which no parts intersect and no trial
fails."""

SHINE = {"coating.specularity": (0.0, 0.3), "lights.*.flux": (1.0, 2.0)}
"""Ranges of specularity (0 to 1) and flux (mW) of the rendered trials, of which none fails."""
LIGHT = {
    "photons": 500_000,
    "resolution": (320, 240),
    "places": ((0.0, 0.0), (4.0, 0.0), (4.0, 3.0)),
}
"""Settings of a rendered trial, which then takes a few seconds: photons, pixels, and places
(mm)."""

WARM = 1
"""Number of first trials of each worker that are not counted: it builds its model and compiles."""
LEAST = 5
"""Smallest number of counted trials of each worker."""
SECONDS = 6.0
"""Shortest time (s) over which trials are counted, many times that of a trial by rays."""


class Clocked:
    """Evaluator that also records the processor time of each trial."""

    def __init__(self, evaluator: Evaluator) -> None:
        self.evaluator = evaluator

    def __call__(self, vector: np.ndarray, seed: int) -> Outcome:
        """See `optisense.search.evaluation.evaluator.Evaluator`."""
        began = time.process_time()
        outcome = self.evaluator(vector, seed)
        spent = time.process_time() - began
        return replace(outcome, parts={**outcome.parts, "clock": {"cpu": spent}})


def workers() -> dict[str, Any]:
    """Measure an objective of chief rays and one of rendered images."""
    mini, svelte = optisense.load("gelsight-mini-ideal"), optisense.load("gelsight-svelte")
    cases: dict[str, Any] = {
        "chief_rays": (svelte, SearchSpace(BLEND), "aoap", {}, 1.8),
        "rendered": (mini, SearchSpace(SHINE), "rgb2normal", LIGHT, 1.6),
    }
    found: dict[str, Any] = {}
    for name, (design, space, goal, settings, target) in cases.items():
        plan = Plan(space=space, goals=[goal], method="random", budget=10_000, settings=settings)
        whole = f"one_with_{processors()}_threads"
        each = {
            "one": _measured(design, plan, 1, 1),
            "two": _measured(design, plan, 2, 1),
            whole: _measured(design, plan, 1, processors()),
        }
        rate = {key: one["trials_a_second"] for key, one in each.items()}
        cpu = {key: one["cpu_seconds_a_trial"] for key, one in each.items()}
        found[name] = {
            "objective": goal,
            **each,
            "two_to_one": round(rate["two"] / rate["one"], 3),
            "two_to_one_with_all_threads": round(rate["two"] / rate[whole], 3),
            "two_to_one_by_processor_time": round(2.0 * cpu["one"] / cpu["two"], 3),
            "target": target,
        }
    return found


def _measured(design: SensorDesign, plan: Plan, count: int, threads: int) -> dict[str, Any]:
    """Return the throughput of workers after all of them have warmed up."""
    study = Study.create(None, design, plan)
    counted: list[list[Row]] = []

    def stop(progress: Any) -> None:
        found = _warm(study.store.rows(), count)
        if found and all(
            len(rows) > LEAST and (rows[-1].finished or 0.0) - (rows[0].finished or 0.0) > SECONDS
            for rows in found
        ):
            counted.extend(found)
            raise KeyboardInterrupt

    def runner(evaluator: Evaluator) -> Runner:
        return ProcessPool(Clocked(evaluator), count, threads=threads)

    StudyRun(study, runner, stop).run()
    study.close()
    rates = [(len(rows) - 1) / (rows[-1].finished - rows[0].finished) for rows in counted]  # type: ignore[operator]
    cpu = [row.outcome.parts["clock"]["cpu"] for rows in counted for row in rows[1:] if row.outcome]
    return {
        "trials_a_second": round(sum(rates), 3),
        "cpu_seconds_a_trial": round(float(np.mean(cpu)), 4),
        "trials": len(cpu),
    }


def _warm(rows: list[Row], count: int) -> list[list[Row]]:
    """Return the finished trials of each worker since all are warm; none before."""
    by_worker: dict[str, list[Row]] = defaultdict(list)
    for row in sorted(rows, key=lambda row: row.finished or 0.0):
        if row.outcome is not None:
            by_worker[row.outcome.worker].append(row)
    if len(by_worker) < count or any(len(each) <= WARM for each in by_worker.values()):
        return []
    since = max(each[WARM].finished or 0.0 for each in by_worker.values())
    return [[row for row in each if (row.finished or 0.0) >= since] for each in by_worker.values()]
