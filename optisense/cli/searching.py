"""Progress of a search on standard error."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING

from optisense.cli.console import print_notes
from optisense.cli.progress import about, progress_line

if TYPE_CHECKING:
    from optisense.search import SearchProgress

WORTH_STOPPING = 20.0
"""Time left (s) from which on a search is worth stopping. With less left, warnings are left to its
result, which says the same.
"""

CONDITIONS = "conditions"
"""Key of the warning that no trial meets the conditions."""


@contextmanager
def search_progress(workers: int) -> Iterator[Callable[[SearchProgress], None]]:
    """Yield a function that shows the number of trials and the time left, with the best score so
    far, failures and trials per hour.

    With one worker Ctrl-C waits for the current trial; several workers drop theirs at once.
    """
    last: list[SearchProgress] = []
    waits = (lambda line: _waits(last)) if workers == 1 else None
    with progress_line(waits) as line:
        line.begin("loading")
        warnings = EarlyWarnings()

        def show(progress: SearchProgress) -> None:
            last[:] = [progress]
            print_notes(warnings.of(progress))
            line.follow(*stage_text(progress), notes(progress))

        yield show


def stage_text(progress: SearchProgress) -> tuple[str, int | None, int | None]:
    """Return the text of the current stage, the number of finished pieces and that of all."""
    if progress.stage == "start":
        return "scoring the start", None, None
    if progress.stage == "trials":
        return "trials", progress.done, progress.total
    if not progress.total:
        return "scoring the best again", None, None
    return "scoring the best again", progress.done, progress.total


def notes(progress: SearchProgress) -> list[str]:
    """Return the notes beside the bar, the most important first."""
    parts = []
    if math.isfinite(progress.best):
        parts.append(f"best {_score(progress.best)} (start {_score(progress.start)})")
        if progress.worsened:
            parts.append(f"but {_listed(progress.worsened)}")
    elif progress.nearest:
        parts.append(f"no trial meets the conditions yet, nearest: {progress.nearest}")
    if progress.broken:
        parts.append(f"{progress.broken} break a condition")
    if progress.failed:
        parts.append(f"{progress.failed} failed")
    if progress.trials_per_hour > 0.0 and progress.stage == "trials":
        parts.append(f"{progress.trials_per_hour:,.0f} trials/h")
    elif progress.doing:
        parts.append(progress.doing)
    return parts


class EarlyWarnings:
    """Warnings that a search runs the wrong way, told once and while there is time to stop it."""

    def __init__(self) -> None:
        self._told: set[str] = set()

    def of(self, progress: SearchProgress) -> list[str]:
        """Return the warnings that were not told before."""
        if progress.stage != "trials" or not progress.seconds_left >= WORTH_STOPPING:
            return []
        found = []
        new = progress.worsened.keys() - self._told
        if new:
            self._told |= new
            found.append(
                "the score improves, but the best trial so far has "
                f"{_listed(progress.worsened)}. Ctrl-C stops the search; --require makes another "
                "one keep such a quantity"
            )
        if progress.generations and progress.nearest and CONDITIONS not in self._told:
            self._told.add(CONDITIONS)
            found.append(
                f"none of the first {progress.done} trials meets all conditions; the nearest one "
                f"breaks {progress.nearest}"
            )
        return found


def _listed(worsened: Mapping[str, str]) -> str:
    return ", ".join(f"{name} {values}" for name, values in worsened.items())


def _waits(last: list[SearchProgress]) -> str:
    """Return what a first Ctrl-C waits for if trials are scored in this process."""
    if not last:
        return "preparing the sensor; nothing has been scored yet"
    if last[0].stage == "start":
        return "finishing the score of the start"
    if last[0].stage != "trials":
        return "finishing the current score"
    hourly = last[0].trials_per_hour
    took = about(3600.0 / hourly) if hourly > 0.0 else ""
    return f"finishing trial {last[0].done + 1}{took}"


def _score(value: float) -> str:
    return f"{value:.4g}" if math.isfinite(value) else "-"
