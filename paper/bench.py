"""Evaluation of units, one after the other or in several processes.

A process computes a share of units in a row, to reuse scenes and light. A sensor with other
dimensions needs a new scene, and another coating or seed needs new photons; other contacts,
pictures and scores under the same light need neither.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import FIRST_COMPLETED, wait
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from optisense.json_values import json_ready
from optisense.search.evaluation.outcome import Outcome
from optisense.search.executors import ProcessPool
from paper.unit import ExperimentError, Record, Unit, kept, work_out

ShowUnits = Callable[[int, int, str], None]
"""Progress callback: takes the number of finished units, of all units, and the label of one."""

TICK = 0.2
"""Longest wait for a worker process before Ctrl-C is noticed, s; users notice no delay of 0.2 s."""
LEAST_UNITS = 6
"""Smallest number of units of a share, if so many have the same sensor.

Smaller shares build the sensor again more often. Larger ones leave processes idle at the end and
make the progress line jump.
"""


class Bench:
    """Evaluates units and keeps their results in a folder.

    Attributes:
        folder: folder of all results.
        workers: number of processes; 1 computes in the calling process.
    """

    def __init__(self, folder: Path, workers: int = 1, show: ShowUnits | None = None) -> None:
        """Prepare the evaluation; nothing is computed yet.

        Args:
            folder: folder of all results.
            workers: number of processes.
            show: progress callback.
        """
        self.folder = folder
        self.workers = workers
        self._show = show or (lambda done, count, label: None)

    def run(self, units: Sequence[Unit]) -> list[Record]:
        """Return the results of units, in their order; results in the folder are not computed
        again.

        Raises:
            ExperimentError: the process of a unit ends each time without a result.
            SetupError: the engine can't compute here.
            OutputError: a result can't be written.
        """
        keys = [unit.key for unit in units]
        missing = {
            key: unit
            for key, unit in zip(keys, units, strict=True)
            if kept(unit, self.folder) is None
        }
        done = len(set(keys)) - len(missing)
        self._show(done, done + len(missing), "")
        together = shares(unit for unit in missing.values() if not unit.alone)
        if self.workers > 1 and len(together) > 1:
            done = self._by_pool(together, done, done + len(missing))
            together = []
        alone = [unit for unit in missing.values() if unit.alone]
        for unit in [*(unit for share in together for unit in share), *alone]:
            self._show(done, len(set(keys)), unit.label)
            work_out(unit, self.folder)
            done += 1
            self._show(done, len(set(keys)), unit.label)
        return [self._kept(unit) for unit in units]

    def _by_pool(self, together: Sequence[list[Unit]], done: int, count: int) -> int:
        """Compute shares of units in worker processes; return the number of finished units."""
        worker = _Worker(together, self.folder)
        with ProcessPool(worker, min(self.workers, len(together))) as pool:
            running = {
                pool.submit(np.array([float(number)]), 0): share
                for number, share in enumerate(together)
            }
            while running:
                for future in wait(running, TICK, FIRST_COMPLETED).done:
                    share, outcome = running.pop(future), future.result()
                    if outcome.failure is not None:
                        names = " or ".join(unit.label for unit in share)
                        raise ExperimentError(f"{names} can't be computed: {outcome.failure}")
                    done += len(share)
                    self._show(done, count, share[-1].label)
        return done

    def _kept(self, unit: Unit) -> Record:
        """Return the kept result of a unit that was computed.

        Raises:
            ExperimentError: the result was deleted.
        """
        record = kept(unit, self.folder)
        if record is None:
            raise ExperimentError(
                f"the result of {unit.label} is missing",
                where=str(self.folder),
                hint="Run it again",
            )
        return record


class _Worker:
    """Function of the worker processes, which computes a share of units by its number."""

    renders = True

    def __init__(self, together: Sequence[list[Unit]], folder: Path) -> None:
        self._shares = list(together)
        self._folder = folder

    def __call__(self, vector: NDArray[np.float64], seed: int) -> Outcome:
        """Compute the share with this number, as `Evaluator` of searches; results are written to
        files."""
        for unit in self._shares[int(vector[0])]:
            if kept(unit, self._folder) is None:  # a process that died may have written it
                work_out(unit, self._folder)
        return Outcome({})


def shares(units: Iterable[Unit]) -> list[list[Unit]]:
    """Return units in groups: those with the same light together, then those of the same sensor.

    The groups are in the order in which sensors and lights first occur.
    """
    by_sensor: dict[str, dict[str, list[Unit]]] = {}
    for unit in units:
        by_sensor.setdefault(_sensor(unit), {}).setdefault(_light(unit), []).append(unit)
    found: list[list[Unit]] = []
    for lights in by_sensor.values():
        share: list[Unit] = []
        for group in lights.values():
            share += group
            if len(share) >= LEAST_UNITS:
                found.append(share)
                share = []
        if share:
            found.append(share)
    return found


def _sensor(unit: Unit) -> str:
    """Return a text that is the same for units with the same scene; a search has one of its own."""
    design = unit.inputs.get("design")
    if design is None or "method" in unit.inputs:
        return unit.key
    return json.dumps(json_ready([design["sensor"], design["dimensions"]]), sort_keys=True)


def _light(unit: Unit) -> str:
    """Return a text that is the same for units that trace the same photons."""
    asked = {**unit.inputs, **unit.inputs.get("settings", {})}
    light = [asked.get("design"), asked.get("photons"), asked.get("seed")]
    return json.dumps(json_ready(light), sort_keys=True)
