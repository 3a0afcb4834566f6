"""Events about a search for a front end, from the trials that the search writes."""

from __future__ import annotations

import math
import threading
import time
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Any

from optisense.engine.failures import Cancelled
from optisense.engine.jobs import Job
from optisense.engine.search_process import SearchProcess, is_running
from optisense.engine.session import Files
from optisense.time_left import TimeLeft

if TYPE_CHECKING:
    from optisense.search import Study, Trial
    from optisense.search.study.store import Row

POLL_INTERVAL = 0.25
"""Interval between two readings of the study, s, short enough to seem immediate; it is longer if a
reading takes long."""

LOOKING_SHARE = 0.05
"""Largest share of the time for readings of a study, so that they hardly slow the search."""

MOST_AT_ONCE = 20
"""Largest number of trials that a reading reports one by one, as many as a list in a front end
shows; of more, only the best and the last are reported.
"""


class Following:
    """Follower of a study until no process runs it any more."""

    def __init__(
        self,
        folder: Path,
        job: Job,
        files: Files,
        child: SearchProcess | None,
        budget: int | None = None,
    ) -> None:
        """Store the arguments; `result` follows the study.

        Args:
            files: files for the meshes of the best trial.
            child: process that runs the study, if the engine has started it.
            budget: total number of trials; the study's own budget if None.
        """
        self._budget = budget
        self._folder = folder
        self._job = job
        self._files = files
        self._child = child
        self._reported: set[int] = set()
        self._best = -math.inf
        self._left = threading.Event()
        self._done = self._failed = 0
        self._said = ""
        self._time_left: TimeLeft | None = None

    def result(self) -> dict[str, Any]:
        """Follow the study to its end, and return its result.

        Raises:
            OptiSenseError: there is no study, or the search failed.
            Cancelled: the study was only watched, and that was cancelled.
        """
        from optisense.search import Study

        with closing(Study.open(self._folder)) as study:
            self._job.send(
                "begun",
                study=str(self._folder),
                pid=None if self._child is None else self._child.pid,
                budget=self._total(study),
                objectives=study.settings.names,
                parameters=study.space.names,
            )
            self._job.on_cancel(self._cancel)
            self._follow(study)
            summary = self._outcome(study)
        return {
            "study": str(self._folder),
            "done": self._done,
            "failed": self._failed,
            **summary,
        }

    def _cancel(self, leaving: bool) -> None:
        """Stop the engine's own search, or stop following another's."""
        if self._child is not None and not (leaving and self._child.go_on):
            self._child.stop()
        else:
            self._left.set()

    def _follow(self, study: Study) -> None:
        while not self._left.is_set():
            running = self._runs()  # read first, so that the last trials are seen
            began = time.monotonic()
            self._look(study)
            if not running:
                return
            took = time.monotonic() - began
            self._left.wait(max(POLL_INTERVAL, took / LOOKING_SHARE))

    def _runs(self) -> bool:
        return is_running(self._folder) if self._child is None else self._child.running

    def _look(self, study: Study) -> None:
        """Report the trials that were finished since the last look."""
        rows = [row for row in study.store.rows() if row.outcome is not None]
        new = [row for row in rows if row.number not in self._reported]
        self._reported.update(row.number for row in new)
        self._done = sum(row.generation >= 0 for row in rows)
        self._failed = sum(
            row.generation >= 0 and bool(row.outcome.lacking([study.objective]))
            for row in rows
            if row.outcome is not None
        )
        if self._time_left is None:
            self._time_left = TimeLeft(self._total(study), self._done)
        said = self._in_words(study)
        if not new and said == self._said:
            return
        self._said = said
        best = max((_score(row, study.objective) for row in new), default=-math.inf)
        for row in new:
            is_best = _score(row, study.objective) == best > self._best
            if is_best:
                self._best = best
            if is_best or len(new) <= MOST_AT_ONCE or row is new[-1]:
                self._tell(study, row, is_best)
        total = self._total(study)
        self._time_left.advance(self._done)
        left = self._time_left.seconds_left
        self._job.send(
            "progress",
            done=self._done,
            total=total,
            failed=self._failed,
            fraction=min(1.0, self._done / max(1, total)),
            seconds_left=round(left, 1) if math.isfinite(left) else None,
            text=said,
        )

    def _in_words(self, study: Study) -> str:
        """Return what the search does, and how far it is."""
        from optisense.search.study.progress import FRESH, START_STAGE

        stage = study.store.fact("stage")
        if stage == START_STAGE:
            return "scoring this sensor"
        if stage == FRESH:
            return "scoring the best again"
        return f"{self._done} of {self._total(study)} trials"

    def _tell(self, study: Study, row: Row, is_best: bool) -> None:
        from optisense.engine.designing import bent_shapes

        trial = study.trial_of(row)
        shapes = bent_shapes(trial.design, self._files, study.space.design) if is_best else {}
        self._job.send(
            "trial",
            **trial_row(study, trial),
            done=self._done,
            total=self._total(study),
            best=is_best,
            shapes=shapes,
        )

    def _total(self, study: Study) -> int:
        """Return the total number of trials of the study."""
        return study.budget if self._budget is None else self._budget

    def _outcome(self, study: Study) -> dict[str, Any]:
        if self._child is not None and not self._left.is_set():
            return self._child.outcome()
        if self._child is None and self._job.cancelled:
            raise Cancelled
        from optisense.search import SearchResult

        ended = study.store.fact("ended")
        return SearchResult(study, ended == "interrupted", ended).to_dict()


def _score(row: Row, objective: str) -> float:
    assert row.outcome is not None
    if not row.outcome.is_feasible:
        return -math.inf
    score = row.outcome.scores.get(objective, math.nan)
    return score if math.isfinite(score) else -math.inf


def curve_row(trial: Trial) -> dict[str, Any]:
    """Return a point of the curve of scores."""
    return {
        "number": trial.number,
        "start": trial.is_start,
        "scores": trial.scores,
        "failure": trial.failure,
        "feasible": math.isfinite(trial.score) and trial.is_feasible,
    }


def trial_row(study: Study, trial: Trial) -> dict[str, Any]:
    """Return a trial without its design."""
    from optisense.search.study.conditions import condition_results
    from optisense.search.study.study import beside

    return {
        **curve_row(trial),
        "values": trial.values,
        "vector": trial.vector,
        "beside": beside(study, trial),
        "conditions": [
            {"condition": each.text, "value": each.value, "margin": each.margin}
            for each in condition_results(trial.conditions, trial)
        ],
    }
