"""Progress on standard error: one live line on a terminal, or a line from time to time in a log."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

from optisense.cli import stopping
from optisense.cli.console import messages
from optisense.time_left import TimeLeft

if TYPE_CHECKING:
    from rich.text import Text

LOG_EVERY = 30.0
"""Shortest interval between lines if standard error is no terminal, s; short enough to see
progress, and logs stay short.
"""

REFRESHES = 4
"""Redraws of the live progress line per second; more would not be seen and take processor time."""

MOST_BAR, LEAST_BAR = 30, 8
"""Largest and smallest width of the bar, columns; with less room than that it is omitted."""


class ProgressLine:
    """Progress of a command: the current step, its time left, and results so far.

    ``scoring trial 12/40 ━━━━━━━━━━━━╸━━━━━━━━━━━  0:42, 3:10 left  best 0.6123``
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        """Start the clock.

        Args:
            clock: function that returns the time, s.
        """
        self._clock = clock
        self._began = self._logged = clock()
        self._what = "starting"
        self._count = ""
        self._notes: tuple[str, ...] = ()
        self._step: TimeLeft | None = None
        self._log_lines = False
        self._lock = threading.Lock()

    def begin(self, what: str, count: float | None = None, done: float = 0.0) -> None:
        """Begin a step of the work.

        Args:
            what: text of the step.
            count: number of its pieces; None if unknown.
            done: number of pieces that were finished earlier.
        """
        with self._lock:
            self._step = None if count is None else TimeLeft(count, done, self._clock)
        self.say(what, done, count)

    def advance(self, done: float, count: float | None = None, *notes: str) -> None:
        """Show that ``done`` pieces of the step are finished, of ``count`` if it is given."""
        with self._lock:
            if self._step is None:
                self._step = TimeLeft(1.0 if count is None else count, done, self._clock)
            self._step.count = self._step.count if count is None else count
            self._step.advance(done)
        self.say(self._what, done, count, *notes)

    def follow(
        self, what: str, done: float | None, count: float | None, notes: Sequence[str] = ()
    ) -> None:
        """Show progress of work that begins a step whenever its text changes."""
        if what != self._what:
            self.begin(what, count, done or 0.0)
        if done is None or count is None:
            self.say(what, done, count, *notes)
        else:
            self.advance(done, count, *notes)

    def say(
        self, what: str, done: float | None = None, count: float | None = None, *notes: str
    ) -> None:
        """Change the texts: the step, the pieces finished and in all, and notes by importance."""
        self._what = what
        self._count = f"{int(done or 0)}/{int(count)}" if count is not None else ""
        self._notes = notes
        if self._log_lines:
            self._log()

    @property
    def pace(self) -> float:
        """Time from piece to piece of the step, s; NaN if unknown."""
        with self._lock:
            return math.nan if self._step is None else self._step.pace

    @property
    def seconds_left(self) -> float:
        """Time until the end of the step, s; NaN if unknown."""
        with self._lock:
            return math.nan if self._step is None else self._step.seconds_left

    @property
    def fraction(self) -> float:
        """Finished share of the step; 0 if unknown."""
        with self._lock:
            return 0.0 if self._step is None else self._step.fraction

    def text(self, columns: int) -> Text:
        """Return the line, in at most ``columns`` columns."""
        from rich.text import Text

        left = self.seconds_left
        head = " ".join(part for part in (self._what, self._count) if part)
        clock = duration(self._clock() - self._began)
        if math.isfinite(left):
            clock += f", {duration(left)} left"
        room = columns - len(clock) - 2
        if len(head) > room:
            short = f"{head[: room - 1]}…  " if room > 1 else ""
            return Text(f"{short}{clock}"[:columns])
        notes = ""
        for note in self._notes:
            if len(head) + 1 + LEAST_BAR + 2 + len(clock) + len(notes) + 2 + len(note) > columns:
                break
            notes += f"  {note}"
        bar = min(MOST_BAR, columns - len(head) - 1 - 2 - len(clock) - len(notes))
        line = Text(head)
        if bar >= LEAST_BAR:
            full = round(self.fraction * bar)
            line.append(" ")
            line.append("━" * full, style="bar.complete")
            line.append("─" * (bar - full), style="bar.back")
        line.append(f"  {clock}")
        line.append(notes, style="dim")
        return line

    def _log(self) -> None:
        """Print a line in a log, if the last one is `LOG_EVERY` seconds old."""
        now = self._clock()
        if now - self._logged < LOG_EVERY:
            return
        self._logged = now
        parts = [f"{self._what} {self._count}".strip(), f"{duration(now - self._began)} so far"]
        if math.isfinite(self.seconds_left):
            parts.append(f"{duration(self.seconds_left)} left")
        messages.print(", ".join([*parts, *self._notes]))


@contextmanager
def progress_line(
    waits: Callable[[ProgressLine], str] | None = None,
) -> Iterator[ProgressLine]:
    """Show a line of progress that vanishes at its end; without a terminal, print lines from time
    to time.

    Args:
        waits: function that says what Ctrl-C waits for, if it does; see `stopping.waiting`.
    """
    line = ProgressLine(time.monotonic)
    with stopping.waiting(None if waits is None else lambda: waits(line)):
        if not messages.is_terminal:
            line._log_lines = True
            yield line
            return
        from rich.live import Live

        def drawn() -> Text:
            return line.text(messages.width - 1)

        with Live(
            get_renderable=drawn,
            console=messages,
            refresh_per_second=REFRESHES,
            transient=True,
            redirect_stdout=False,
            redirect_stderr=False,
        ):
            yield line


def duration(seconds: float) -> str:
    """Format a time as 1:02:03 or 2:03."""
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{rest:02}" if hours else f"{minutes}:{rest:02}"


def about(seconds: float) -> str:
    """Return a time in words, to end a phrase: ", about 12 s"; empty if it is unknown."""
    if not math.isfinite(seconds):
        return ""
    if seconds < 100.0:
        return f", about {max(1, math.ceil(seconds))} s"
    return f", about {math.ceil(seconds / 60.0)} min"
