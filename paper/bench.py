"""The bench on which units are worked out, one after the other or on several processes."""

from __future__ import annotations

import queue
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from optisense.search.evaluation.outcome import Outcome
from optisense.search.executors import ProcessPool
from paper.errors import ExperimentError
from paper.shares import shares
from paper.unit import Record, Unit, kept, work_out

Tell = Callable[[int, int, str], None]
"""Called with the number of finished units, of all units, and the label of one."""

TICK = 0.2
"""Seconds between looks at the keyboard while other processes work."""


Finished = queue.SimpleQueue[tuple[list[Unit], Future[Outcome]]]
"""Shares of units that processes are done with."""


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
        together = shares(unit for unit in missing.values() if not unit.alone)
        if self.workers > 1 and len(together) > 1:
            done = self._by_pool(together, done, done + len(missing))
            together = []
        alone = [unit for unit in missing.values() if unit.alone]
        for unit in [*(unit for share in together for unit in share), *alone]:
            self._tell(done, len(set(keys)), unit.label)
            work_out(unit, self.folder)
            done += 1
            self._tell(done, len(set(keys)), unit.label)
        return [self._kept(unit) for unit in units]

    def _by_pool(self, together: Sequence[list[Unit]], done: int, count: int) -> int:
        finished: Finished = queue.SimpleQueue()

        def hand_over(share: list[Unit], future: Future[Outcome]) -> None:
            finished.put((share, future))

        worker = _Worker(together, self.folder)
        with ProcessPool(worker, min(self.workers, len(together))) as pool:
            for number, share in enumerate(together):
                future = pool.submit(np.array([float(number)]), 0)
                future.add_done_callback(lambda f, share=share: hand_over(share, f))  # type: ignore[misc]
            for _ in together:
                share, future = self._wait(finished)
                outcome = future.result()
                if outcome.failure is not None:
                    names = " or ".join(unit.label for unit in share)
                    raise ExperimentError(f"{names} can't be worked out: {outcome.failure}")
                done += len(share)
                self._tell(done, count, share[-1].label)
        return done

    @staticmethod
    def _wait(finished: Finished) -> tuple[list[Unit], Future[Outcome]]:
        """The next finished share; Ctrl-C gets through."""
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
    """What a process of the pool calls: works out a share of units by its number."""

    renders = True

    def __init__(self, together: Sequence[list[Unit]], folder: Path) -> None:
        self._shares = list(together)
        self._folder = folder

    def __call__(self, vector: NDArray[np.float64], seed: int) -> Outcome:
        """See `Evaluator` of searches; the results are in the units' files."""
        for unit in self._shares[int(vector[0])]:
            if kept(unit, self._folder) is None:  # it may be there: of a process that died
                work_out(unit, self._folder)
        return Outcome({})
