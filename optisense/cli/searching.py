"""How far a search is, on standard error."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from optisense.cli.progress import counting_bar

if TYPE_CHECKING:
    from optisense.search import Progress


@contextmanager
def search_progress(method: str) -> Iterator[Callable[[Progress], None]]:
    """Trials done, with the best score so far, trials an hour and the time left."""
    with counting_bar(method, left=False, note="getting ready") as show:
        yield lambda progress: show(progress.done, progress.total, note(progress))


def note(progress: Progress) -> str:
    """What stands beside the bar."""
    if progress.stage != "trials":
        return f"best {_score(progress.best)}; scoring the best again with {progress.stage}"
    parts = [f"best {_score(progress.best)} (start {_score(progress.start)})"]
    if progress.trials_per_hour > 0.0:
        parts.append(f"{progress.trials_per_hour:,.0f} trials/h")
    if progress.failed:
        parts.append(f"{progress.failed} failed")
    if math.isfinite(progress.seconds_left):
        parts.append(f"{duration(progress.seconds_left)} left")
    return "  ".join(parts)


def duration(seconds: float) -> str:
    """Hours, minutes and seconds as 1:02:03."""
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{rest:02}" if hours else f"{minutes}:{rest:02}"


def _score(value: float) -> str:
    return f"{value:.4g}" if math.isfinite(value) else "-"
