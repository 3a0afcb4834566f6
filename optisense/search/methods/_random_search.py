"""Search by points spread evenly: a baseline that shows how a score depends on all parameters."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from optisense.array_types import FloatArray
from optisense.search.evaluation.outcome import Outcome
from optisense.search.methods.base import Method, Problem

GENERATION = 64
"""Number of points that are drawn together, which keeps all workers busy; a power of two, as
Sobol's sequence is balanced after those."""


class Random(Method):
    """Scrambled Sobol points: random, and more evenly spread than independent draws
    (Owen, "Scrambled net variance for integrals of smooth functions", 1997).
    """

    name = "random"
    summary = "points spread evenly over the space"
    accepts_coarse_scores = True

    def __init__(self, problem: Problem) -> None:
        from scipy.stats import qmc  # takes half a second to load

        super().__init__(problem)
        with _held_interrupts():
            self._points = qmc.Sobol(problem.space.size, seed=problem.random(self.name))

    def ask(self) -> FloatArray:
        """Return the next points, (k, n)."""
        return self.space.from_unit(self._points.random(GENERATION))

    def tell(self, vectors: FloatArray, outcomes: Sequence[Outcome]) -> None:
        """Ignore the outcomes of a generation (k, n): random search does not learn."""


@contextmanager
def _held_interrupts() -> Iterator[None]:
    """Hold Ctrl-C back until the end of the block; nothing changes outside the main thread, where
    signals can't be handled. SciPy loads the tables of Sobol's sequence in compiled code that drops
    exceptions: after a KeyboardInterrupt the search would go on with incomplete tables.
    """
    before = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or not callable(before):
        yield
        return
    came: list[int] = []
    signal.signal(signal.SIGINT, lambda number, frame: came.append(number))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
    if came:
        before(came[0], None)
