"""How far a search is, on standard error."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from optisense.cli.progress import about, progress_line

if TYPE_CHECKING:
    from optisense.search import SearchProgress


@contextmanager
def search_progress(workers: int) -> Iterator[Callable[[SearchProgress], None]]:
    """Trials done and the time left, with the best score so far, failures and trials an hour.

    With one worker Ctrl-C waits for the trial at hand; others drop theirs at once.
    """
    last: list[SearchProgress] = []
    waits = (lambda line: _waits(last)) if workers == 1 else None
    with progress_line(waits=waits) as line:
        line.say("loading")

        def show(progress: SearchProgress) -> None:
            last[:] = [progress]
            line.show(*what(progress), progress.seconds_left, notes(progress))

        yield show


def what(progress: SearchProgress) -> tuple[str, int | None, int | None]:
    """What is being done, how many are done and of how many."""
    if progress.stage == "start":
        return "scoring the start", None, None
    if progress.stage == "trials":
        return "trials", progress.done, progress.total
    if not progress.total:
        return "scoring the best again", None, None
    return "scoring the best again", progress.done, progress.total


def notes(progress: SearchProgress) -> list[str]:
    """What stands beside the bar, the foremost first."""
    parts = []
    if math.isfinite(progress.best):
        parts.append(f"best {_score(progress.best)} (start {_score(progress.start)})")
    if progress.failed:
        parts.append(f"{progress.failed} failed")
    if progress.trials_per_hour > 0.0 and progress.stage == "trials":
        parts.append(f"{progress.trials_per_hour:,.0f} trials/h")
    elif progress.doing:
        parts.append(progress.doing)
    return parts


def _waits(last: list[SearchProgress]) -> str:
    """What a first Ctrl-C waits for where trials are worked out in this process."""
    if not last or last[0].stage == "start":
        return "finishing the score of the start"
    if last[0].stage != "trials":
        return "finishing the score at hand"
    hourly = last[0].trials_per_hour
    took = about(3600.0 / hourly) if hourly > 0.0 else ""
    return f"finishing trial {last[0].done + 1}{took}"


def _score(value: float) -> str:
    return f"{value:.4g}" if math.isfinite(value) else "-"
