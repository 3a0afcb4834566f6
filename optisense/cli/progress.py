"""Progress on standard error: bars on a terminal, lines in a log."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Protocol

from optisense.cli.console import messages

if TYPE_CHECKING:
    from rich.progress import Progress, ProgressColumn

LINE_EVERY = 30.0
"""Seconds between lines where standard error is no terminal."""


@contextmanager
def passing_bar(what: str, *columns: ProgressColumn) -> Iterator[Progress]:
    """A bar on standard error that vanishes at its end; silent when that is no terminal.

    Args:
        what: stands before the bar.
        columns: stand behind it.
    """
    from rich.progress import BarColumn, Progress, TextColumn

    with Progress(
        TextColumn(what),
        BarColumn(bar_width=32),
        *columns,
        console=messages,
        transient=True,
        disable=not messages.is_terminal,
    ) as bar:
        yield bar


class Counter(Protocol):
    """Told how much is done: pieces finished, of how many if known, and a word on it."""

    def __call__(self, done: int, count: int | None, note: str = "") -> None:
        """Show it."""


@contextmanager
def counting_bar(what: str, *, left: bool = True, note: str = "") -> Iterator[Counter]:
    """A bar that counts finished pieces of work; lines in a log where there is no terminal.

    Args:
        what: stands before the bar.
        left: whether to show the time left, as if all pieces took as long as those so far.
        note: stands behind the bar until something else is told.
    """
    if not messages.is_terminal:
        yield LogLines(what)
        return
    from rich.progress import (
        MofNCompleteColumn,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )

    columns = [MofNCompleteColumn(), TimeElapsedColumn()]
    if left:
        columns += [TextColumn("left"), TimeRemainingColumn()]
    with passing_bar(what, *columns, TextColumn("{task.fields[note]}")) as bar:
        task = bar.add_task(what, total=None, note=note)

        def show(done: int, count: int | None, note: str = "") -> None:
            bar.update(task, completed=done, total=count, note=note)

        yield show


class LogLines:
    """A line now and then, for a log: ``all: 120 of 431, 14.2 min, cylinder, seed 1``."""

    def __init__(self, what: str) -> None:
        """``what`` begins each line."""
        self._what = what
        self._began = self._told = time.monotonic()

    def __call__(self, done: int, count: int | None, note: str = "") -> None:
        """Tell it, if the last line is some time ago."""
        now = time.monotonic()
        if now - self._told < LINE_EVERY:
            return
        self._told = now
        parts = [f"{done} of {count}" if count else f"{done}"]
        parts.append(f"{(now - self._began) / 60.0:.1f} min")
        messages.print(f"{self._what}: {', '.join(parts + [note] * bool(note))}", markup=False)
