"""The bench on which units are worked out, one after the other or on several processes."""

from __future__ import annotations

import queue
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from optisense.errors import ExperimentError
from optisense.experiments.unit import Record, Unit, kept, work_out
from optisense.search.executors import ProcessPool
from optisense.search.outcome import Outcome

Tell = Callable[[int, int, str], None]
"""Called with the number of finished units, of all units, and the label of one."""

TICK = 0.2
"""Seconds between looks at the keyboard while other processes work."""


class Bench:
    """Works out units and keeps what they find in a folder.

    Attributes:
        folder: of all results.
        workers: processes; 1 works in this one.
    """

    def __init__(self, folder: Path, workers: int = 1, tell: Tell | None = None) -> None:
        """Nothing is done yet."""
        self.folder = folder
        self.workers = workers
        self._tell = tell or (lambda done, count, label: None)

    def run(self, units: Sequence[Unit]) -> list[Record]:
        """What comes of units, in their order; those whose answers are kept are not asked again.

        Raises:
            ExperimentError: a unit's process dies each time.
            SetupError, OutputError: nothing can be worked out, or kept.
        """
        keys = [unit.key for unit in units]
        missing = {
            key: unit
            for key, unit in zip(keys, units, strict=True)
            if kept(unit, self.folder) is None
        }
        done = len(set(keys)) - len(missing)
        self._tell(done, done + len(missing), "")
        shared = [unit for unit in missing.values() if not unit.alone]
        if self.workers > 1 and len(shared) > 1:
            done = self._by_pool(shared, done, done + len(missing))
            shared = []
        for unit in [*shared, *(unit for unit in missing.values() if unit.alone)]:
            self._tell(done, len(set(keys)), unit.label)
            work_out(unit, self.folder)
            done += 1
            self._tell(done, len(set(keys)), unit.label)
        return [self._kept(unit) for unit in units]

    def _by_pool(self, units: Sequence[Unit], done: int, count: int) -> int:
        finished: queue.SimpleQueue[tuple[Unit, Future[Outcome]]] = queue.SimpleQueue()

        def hand_over(unit: Unit, future: Future[Outcome]) -> None:
            finished.put((unit, future))

        with ProcessPool(_Worker(units, self.folder), min(self.workers, len(units))) as pool:
            for number, unit in enumerate(units):
                future = pool.submit(np.array([float(number)]), 0)
                future.add_done_callback(lambda f, unit=unit: hand_over(unit, f))  # type: ignore[misc]
            for _ in units:
                unit, future = self._wait(finished)
                outcome = future.result()
                if outcome.failure is not None:
                    raise ExperimentError(f"{unit.label} can't be worked out: {outcome.failure}")
                done += 1
                self._tell(done, count, unit.label)
        return done

    @staticmethod
    def _wait(
        finished: queue.SimpleQueue[tuple[Unit, Future[Outcome]]],
    ) -> tuple[Unit, Future[Outcome]]:
        """The next finished unit; Ctrl-C gets through."""
        while True:
            try:
                return finished.get(timeout=TICK)
            except queue.Empty:
                continue

    def _kept(self, unit: Unit) -> Record:
        record = kept(unit, self.folder)
        if record is None:
            raise ExperimentError(
                f"the result of {unit.label} has gone", where=str(self.folder), hint="Run it again"
            )
        return record


class _Worker:
    """What a process of the pool calls: works out a unit by its number."""

    renders = True

    def __init__(self, units: Sequence[Unit], folder: Path) -> None:
        self._units = list(units)
        self._folder = folder

    def __call__(self, vector: NDArray[np.float64], seed: int) -> Outcome:
        """See `optisense.search.evaluation.Evaluator`; what was found is in the unit's file."""
        work_out(self._units[int(vector[0])], self._folder)
        return Outcome({})
