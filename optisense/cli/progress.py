"""Progress bars."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from optisense.cli.console import messages

if TYPE_CHECKING:
    from rich.progress import Progress, ProgressColumn


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


@contextmanager
def counting_bar(what: str) -> Iterator[Callable[[int, int], None]]:
    """A bar that counts finished pieces of work: ``show(done, count)``."""
    from rich.progress import (
        MofNCompleteColumn,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )

    columns = (MofNCompleteColumn(), TimeElapsedColumn(), TextColumn("left"), TimeRemainingColumn())
    with passing_bar(what, *columns) as bar:
        task = bar.add_task(what, total=None)

        def show(done: int, count: int) -> None:
            bar.update(task, completed=done, total=count)

        yield show
