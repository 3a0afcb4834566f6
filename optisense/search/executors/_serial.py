"""Executor that scores trials one after another in this process."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable
from concurrent.futures import Future
from types import FrameType

import numpy as np
from numpy.typing import NDArray

from optisense.search.evaluation.evaluator import Evaluator
from optisense.search.evaluation.outcome import Outcome
from optisense.search.executors.base import Runner


class SerialRunner(Runner):
    """Executor that scores a trial when it is submitted.

    A render that Ctrl-C ends early still gives an image, with a score that must not count. So the
    first Ctrl-C waits until the trial is finished; the second drops it. Where Ctrl-C is ignored, as
    shells arrange it for programs in the background, it stays ignored.
    """

    def __init__(self, evaluator: Evaluator, on_wait: Callable[[], None] | None = None) -> None:
        """Store the evaluator, and the function that is called on Ctrl-C during a trial."""
        self._evaluator = evaluator
        self._on_wait = on_wait
        self._pressed = 0
        self._before: Callable[[int, FrameType | None], object] | int | None = None

    def submit(self, vector: NDArray[np.float64], seed: int) -> Future[Outcome]:
        """Score a point (n,) and return a finished future; KeyboardInterrupt follows if Ctrl-C was
        pressed before this trial, or twice during it.
        """
        if self._pressed:
            raise KeyboardInterrupt
        future: Future[Outcome] = Future()
        try:
            outcome = self._evaluator(vector, seed)
        except Exception as error:
            future.set_exception(error)
            return future
        if self._pressed > 1:
            raise KeyboardInterrupt
        future.set_result(outcome)
        return future

    def report_progress_to(self, callback: Callable[[float, str], None]) -> None:
        """Call `callback` with the progress of the current trial, if its evaluator reports it."""
        getattr(self._evaluator, "report_progress_to", lambda callback: None)(callback)

    def close(self) -> None:
        """Restore the handler of Ctrl-C."""
        if self._before is not None:
            signal.signal(signal.SIGINT, self._before)
            self._before = None

    def __enter__(self) -> SerialRunner:
        in_main_thread = threading.current_thread() is threading.main_thread()
        if in_main_thread and signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
            self._before = signal.signal(signal.SIGINT, self._press)
        return self

    def _press(self, number: int, frame: FrameType | None) -> None:
        self._pressed += 1
        if self._pressed > 1:
            raise KeyboardInterrupt
        if self._on_wait is not None:
            self._on_wait()
