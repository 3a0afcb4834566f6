"""The interface of executors, and the executor that scores trials in this process."""

from __future__ import annotations

import pickle
import signal
import threading
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from types import FrameType
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from optisense.errors import OptiSenseError, SearchError
from optisense.search.evaluation.evaluator import Evaluator
from optisense.search.evaluation.outcome import Outcome

TICK = 0.2
"""Interval between checks of the clock while trials are scored, s; short for a smooth display."""


class Runner(ABC):
    """Base class of executors, which are context managers. Every submitted trial gets exactly one
    outcome.

    Attributes:
        window: number of trials that should be submitted before the first is finished.
    """

    window: int = 1

    @abstractmethod
    def submit(self, vector: NDArray[np.float64], seed: int) -> Future[Outcome]:
        """Submit a trial, and return the future of its outcome.

        The future has an exception only for errors that concern all trials.

        Args:
            vector: point (n,) of the search space.
        """

    def report_progress_to(self, callback: Callable[[float, str], None]) -> None:  # noqa: B027
        """Call `callback` with the progress of a trial, if it is scored in this process."""

    @abstractmethod
    def close(self) -> None:
        """Stop all work at once; unfinished trials are dropped."""

    def __enter__(self) -> Runner:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()


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


def outcome_of(done: Future[Outcome]) -> Outcome:
    """Return the outcome of a future; OptiSenseError if no trial can be scored."""
    error = done.exception()
    if error is None:
        return done.result()
    if isinstance(error, OptiSenseError):
        raise error
    why = str(error) or type(error).__name__
    raise SearchError(f"a trial could not be scored: {why}") from error


def run_jobs(
    runner: Runner,
    jobs: Sequence[tuple[int, NDArray[np.float64], int]],
    finished: Callable[[int, Outcome], None],
    waiting: Callable[[], None] = lambda: None,
) -> None:
    """Keep an executor busy with jobs (number, point, seed), and call `finished` with the number of
    each and its outcome, and `waiting` every `TICK` seconds; OptiSenseError if no trial can be
    scored.
    """
    left = list(reversed(jobs))
    running: dict[Future[Outcome], int] = {}
    while left or running:
        while left and len(running) < runner.window:
            number, vector, seed = left.pop()
            running[runner.submit(vector, seed)] = number
        done, _ = wait(running, TICK, FIRST_COMPLETED)
        for future in sorted(done, key=running.__getitem__):
            finished(running.pop(future), outcome_of(future))
        if not done:
            waiting()


def pickled(evaluator: Evaluator) -> bytes:
    """Return an evaluator as bytes for other processes; SearchError if one of
    its objects can't be.
    """
    try:
        blob = pickle.dumps(evaluator, protocol=pickle.HIGHEST_PROTOCOL)
    except (pickle.PicklingError, AttributeError, TypeError) as error:
        raise SearchError(
            f"workers can't be given an objective or a rule: {error}", hint=PICKLING_HINT
        ) from None
    if b"__main__" in blob:
        raise SearchError(
            "workers can't find functions of the program that starts them", hint=PICKLING_HINT
        )
    return blob


def send(stream: IO[bytes], message: Any) -> None:
    """Write a message between a pool and its workers as a pickle, which ends by itself."""
    stream.write(pickle.dumps(message, protocol=pickle.HIGHEST_PROTOCOL))
    stream.flush()


def receive(stream: IO[bytes]) -> Any:
    """Read a message; EOFError if the process at the other end has closed the pipe."""
    try:
        return pickle.load(stream)
    except pickle.UnpicklingError as error:  # it was killed while it wrote
        raise EOFError from error


PICKLING_HINT = "Put the function into a file and name it as FILE.py:FUNCTION, or use one worker"
