"""Progress of a running study, and its result."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from optisense.search.study.study import Study
from optisense.search.study.trial import Trial

START_STAGE, TRIALS, FRESH = "start", "trials", "fresh seeds"
"""Stages of a search; see `SearchProgress`."""


@dataclass(frozen=True)
class SearchProgress:
    """Progress of a study.

    Attributes:
        stage: "start" while the starting design is scored, "trials", or "fresh seeds" while the
            best trials are scored again.
        done: number of finished trials, including those of earlier runs, without the start. In the
            stage "fresh seeds", number of finished scores.
        total: largest number of trials; in the stage "fresh seeds", expected number of scores.
        failed: number of finished trials without a score by the first objective.
        broken: number of finished trials that break a condition.
        nearest: conditions that the trial nearest to feasibility breaks; empty as soon as a trial
            meets them all.
        worsened: watched quantities, such as coverage, that are worse in the best trial so far than
            in the start, each by name with its value and that of the start.
        generations: number of finished generations of the method.
        best: best score so far of trials that meet all conditions; NaN before there is one.
        start: score of the start.
        trials_per_hour: rate of the last trials; 0 before it is known.
        seconds_left: time until the end of the stage, s; NaN if not known yet.
        doing: stage of the current trial, if it is scored in this process.
    """

    stage: str
    done: int
    total: int
    failed: int
    best: float
    start: float
    trials_per_hour: float
    seconds_left: float
    doing: str = ""
    broken: int = 0
    nearest: str = ""
    worsened: Mapping[str, str] = field(default_factory=dict)
    generations: int = 0


@dataclass(frozen=True)
class SearchResult:
    """Result of a study.

    Attributes:
        study: the study with all its trials; it can be run again to continue.
        interrupted: whether it was stopped before its end.
        ended: reason why it ended.
        notes: notes for the user.
        limit: number of trials at which the run ends, those of earlier runs included; 0 if it is
            not known.
    """

    study: Study
    interrupted: bool
    ended: str
    notes: tuple[str, ...] = ()
    limit: int = 0

    @property
    def best(self) -> Trial:
        """Best trial, by fresh seeds if they were scored.

        Raises:
            SearchError: no trial succeeded.
        """
        return self.study.trial("best")

    @property
    def start(self) -> Trial:
        """Trial of the starting design, or of the nearest point to it in the space.

        Raises:
            SearchError: this trial has not been scored.
        """
        return self.study.trial("start")

    @property
    def trials(self) -> list[Trial]:
        """All finished trials, the start first."""
        return self.study.trials

    @property
    def front(self) -> list[Trial]:
        """Pareto front: the trials that no other one dominates."""
        return self.study.front

    def to_dict(self) -> dict[str, Any]:
        """Return the end of the search, with the number of the best trial, ready for JSON."""
        best = self.study.best
        return {
            "interrupted": self.interrupted,
            "ended": self.ended,
            "notes": list(self.notes),
            "best": None if best is None else best.number,
        }


SearchProgressCallback = Callable[[SearchProgress], None]
"""Function that is called a few times a second while a study runs."""
