"""Time left of work, estimated from the pieces that are finished.

Work is a sequence of steps, and a step is a number of similar pieces: trials, sensors, photon
passes. The measured pieces of a step tell how long its other pieces take. Steps that have not begun
are expected to take their usual time, scaled by the ratio of measured to usual time of the steps
before. The first piece of each worker also loads and compiles programs, so it is left out. Usual
durations are in `optisense.usual_times`.
"""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass

USUAL_PIECES = 0.5
"""Number of measured pieces that the usual duration of a piece counts as in an average: enough to
steady an estimate from a part of the first piece, little against two whole ones.
"""

USUAL_SHARE = 0.15
"""Share of a step's pieces that the usual duration counts as, if parts of pieces are reported and
this is more than `USUAL_PIECES`: the first pieces, which compile, differ from the others.
"""

ROUNDS = 3
"""Number of pieces per worker after which the time between pieces is measured by the clock. Before
that the pieces' own times are averaged, since pieces of several workers end in bunches.
"""

REMEMBERED = 400
"""Largest number of recorded end times of pieces; of more, every second one is dropped."""


@dataclass
class TimedStep:
    """Part of the work.

    Attributes:
        name: name of the step.
        count: number of its pieces; fractions of pieces may be done.
        seconds: usual duration of a piece, all workers together, s; None if unknown.
        warm_up: number of first pieces that also load and compile, and are not representative.
        gauges: whether its duration shows how fast this machine is; loading from a disk, for
            example, does not.
    """

    name: str
    count: float = 1.0
    seconds: float | None = None
    warm_up: float = 0.0
    gauges: bool = True


class TimeLeft:
    """Estimator of the time left of work in steps.

    Attributes:
        workers: number of processes that share the pieces.
    """

    def __init__(
        self,
        steps: Sequence[TimedStep],
        workers: int = 1,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """Start the clock; no step has begun.

        Args:
            workers: number of processes that share pieces with times of their own.
            clock: function that returns the time, s.
        """
        self._steps = list(steps)
        self.workers = max(1, workers)
        self._clock = clock
        self._began = clock()
        self._current = -1
        self._expected, self._measured = 0.0, 0.0
        self._fraction = 0.0
        self._known_workers: set[str] = set()
        self._start_step(0.0)

    def _start_step(self, done: float) -> None:
        now = self._clock()
        self._done = self._first = done
        self._step_began = self._advanced = now
        self._ends: deque[tuple[float, float]] = deque([(now, done)])
        self._own_seconds, self._own_count, self._has_own = 0.0, 0.0, False

    @property
    def elapsed(self) -> float:
        """Time since the clock was started, s."""
        return self._clock() - self._began

    def begin(self, name: str, count: float | None = None, done: float = 0.0) -> None:
        """Begin a step and end the one before it; steps in between are skipped.

        Args:
            name: name of the step, which comes after the current one.
            count: number of its pieces, if it is better known now.
            done: number of pieces that were finished earlier, at no cost now.

        Raises:
            ValueError: no step of this name follows.
        """
        later = [step.name for step in self._steps[self._current + 1 :]]
        if name not in later:
            raise ValueError(f"no step '{name}' follows: {later}")
        self._close_step()
        self._current += 1 + later.index(name)
        if count is not None:
            self._steps[self._current].count = count
        self._start_step(done)

    def expect(
        self,
        name: str,
        count: float | None = None,
        seconds: float | None = None,
        gauges: bool | None = None,
    ) -> None:
        """Correct the expectations of a step: the number of its pieces, the duration of a piece, or
        whether it shows how fast this machine is.
        """
        step = next(step for step in self._steps if step.name == name)
        step.gauges = step.gauges if gauges is None else gauges
        step.count = step.count if count is None else count
        step.seconds = step.seconds if seconds is None else seconds

    def advance(self, done: float, seconds: float | None = None, worker: str = "") -> None:
        """Report how many pieces of the current step are done, including parts of pieces.

        Args:
            done: number of finished pieces, including those finished before `begin`.
            seconds: duration of the pieces since the last call, if several workers are active.
            worker: name of the worker. The first piece of each is not used for the estimate.
        """
        now = self._clock()
        if done <= self._done and seconds is None:
            return
        pieces = done - self._done
        self._done, self._advanced = done, now
        if seconds is not None:
            if worker not in self._known_workers:
                self._known_workers.add(worker)
                if not self._has_own:  # the clock starts again here, too
                    self._ends = deque([(now, done)])
                return
            if pieces <= 0.0:
                return
            if not self._has_own:
                self._ends = deque([(now, done)])
            self._has_own = True
            self._own_seconds += seconds
            self._own_count += pieces
        elif self._steps[self._current].warm_up > self._ends[0][1] - self._first:
            self._ends = deque([(now, done)])
            return
        self._ends.append((now, done))
        if len(self._ends) > REMEMBERED:
            self._ends = deque([self._ends[0], *list(self._ends)[1::2]])

    @property
    def count(self) -> float:
        """Number of pieces of the current step."""
        return self._steps[self._current].count

    @property
    def seconds_left(self) -> float:
        """Time until all is done, s; NaN if unknown."""
        if not self._steps:
            return math.nan
        return sum((self.seconds_left_of(step.name) for step in self._steps), 0.0)

    def seconds_left_of(self, name: str) -> float:
        """Return the remaining time of a step, s; NaN if unknown."""
        place = next(place for place, step in enumerate(self._steps) if step.name == name)
        step = self._steps[place]
        if place < self._current or step.count <= 0.0:
            return 0.0
        if place > self._current:
            return step.count * self._usual(step)
        rest = max(0.0, step.count - self._done)
        if rest == 0.0:
            return 0.0
        # `since` is the elapsed time of the current piece; one that takes longer may end at any
        # moment.
        since = self._clock() - self._advanced
        return max(rest * self.pace - since, (rest - 1.0) * self.pace, 0.0)

    @property
    def fraction(self) -> float:
        """Share of the whole time that has passed, 0 to 1; it never falls."""
        left = self.seconds_left
        if math.isfinite(left):
            elapsed = self.elapsed
            self._fraction = max(self._fraction, elapsed / max(elapsed + left, 1e-9))
        return min(self._fraction, 1.0)

    @property
    def pace(self) -> float:
        """Time from piece to piece of the current step, s; NaN if unknown."""
        step = self._steps[self._current]
        usual = self._usual(step)
        if self._has_own or self._known_workers:
            if not self._has_own:
                return usual
            began, first = self._window()
            end, done = self._ends[-1]
            if done - self._ends[0][1] >= ROUNDS * self.workers and done > first:
                return (end - began) / (done - first)
            known = 0.0 if math.isnan(usual) else USUAL_PIECES
            own = self._own_seconds / self.workers + (known * usual if known else 0.0)
            return own / (self._own_count + known)
        began, first = self._window()
        end, done = self._ends[-1]
        if done <= first:
            return usual
        if not math.isfinite(usual):
            return (end - began) / (done - first)
        weight = _steadying(self._steps[self._current])
        return (end - began + weight * usual) / (done - first + weight)

    def _window(self) -> tuple[float, float]:
        """Return when the pieces that the pace is measured by began, and how many were done then.

        They are the later half of the finished ones, because the pace may change.
        """
        if len(self._ends) < 2 * ROUNDS * self.workers:
            return self._ends[0]
        return self._ends[len(self._ends) // 2]

    def _usual(self, step: TimedStep) -> float:
        """Return the usual duration of a piece, at the measured speed of this machine, s."""
        if step.seconds is None:
            return math.nan
        return step.seconds * self._slowness

    @property
    def _slowness(self) -> float:
        """Ratio of measured to usual duration of the work so far.

        Finished parts of the current step count, and the rest of it once it is late.
        """
        before = self._measured / self._expected if self._expected > 0.0 else 1.0
        step = self._steps[self._current] if self._current >= 0 else None
        if step is None or step.seconds is None:
            return before
        done = self._done - self._first
        if step.gauges and done > 0.0 and not self._known_workers:
            usual = _steadying(step) * step.seconds
            finished = self._expected + step.seconds * done + usual
            spent = self._measured + self._advanced - self._step_began
            before = (spent + usual * before) / finished
        if not step.gauges:
            return before
        pieces = min(self._done + 1.0, step.count) - self._first
        expected = self._expected + step.seconds * max(0.0, pieces)
        measured = self._measured + self._clock() - self._step_began
        return max(before, measured / expected) if expected > 0.0 else before

    def _close_step(self) -> None:
        """Compare the duration of the current step with its usual one."""
        if self._current < 0:
            return
        step = self._steps[self._current]
        if step.gauges and step.seconds is not None and step.count > self._first:
            self._expected += step.seconds * (step.count - self._first)
            self._measured += self._clock() - self._step_began


def _steadying(step: TimedStep) -> float:
    """Return the number of pieces that the usual duration of a step's piece counts as."""
    return max(USUAL_PIECES, USUAL_SHARE * step.count)
