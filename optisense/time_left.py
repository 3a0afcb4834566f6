"""Time left of work, estimated from the finished pieces of it."""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable

REMEMBERED = 400
"""Largest number of recorded end times of pieces; of more, every second one is dropped."""


class TimeLeft:
    """Estimator of the time left of similar pieces of work: trials, sensors, shares of a picture.

    The time from piece to piece is averaged over the later half of the elapsed time, as the first
    pieces also load and compile, workers finish their pieces in bunches, and the pace may change.

    Attributes:
        count: number of pieces; fractions of pieces may be finished.
        done: number of finished pieces, including those from before the clock started.
    """

    def __init__(
        self, count: float, done: float = 0.0, clock: Callable[[], float] = time.monotonic
    ) -> None:
        """Start the clock.

        Args:
            clock: function that returns the time, s.
        """
        self.count = count
        self.done = done
        self._clock = clock
        self._ends: deque[tuple[float, float]] = deque([(clock(), done)])

    def advance(self, done: float) -> None:
        """Report how many pieces are finished, including parts of pieces."""
        if done <= self.done:
            return
        self.done = done
        self._ends.append((self._clock(), done))
        if len(self._ends) > REMEMBERED:
            self._ends = deque(list(self._ends)[::2])

    @property
    def pace(self) -> float:
        """Time from piece to piece, s; NaN before one is finished."""
        *earlier, (end, done) = self._ends
        if not earlier:
            return math.nan
        middle = (earlier[0][0] + end) / 2.0
        since, before = max(each for each in earlier if each[0] <= middle)
        return (end - since) / (done - before)

    @property
    def seconds_left(self) -> float:
        """Time until all pieces are finished, s; NaN if unknown."""
        rest = max(0.0, self.count - self.done)
        if rest == 0.0:
            return 0.0
        # A piece that takes longer than those before it may end at any moment.
        since = self._clock() - self._ends[-1][0]
        return max(rest * self.pace - since, (rest - 1.0) * self.pace, 0.0)

    @property
    def fraction(self) -> float:
        """Finished share of the pieces, 0 to 1."""
        return min(self.done / self.count, 1.0) if self.count > 0.0 else 1.0
