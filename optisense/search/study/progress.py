"""What a running study reports, and what came of it at its end."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from optisense.search.study.study import Study
from optisense.search.study.trial import Trial


@dataclass(frozen=True)
class SearchProgress:
    """How far a study is.

    Attributes:
        stage: "start" while the design as it is is scored, "trials", or "fresh seeds" while the
            best are scored again.
        done: finished trials, those of earlier runs included; the start is not counted. Scores in
            the stage "fresh seeds".
        total: trials that there may be; scores that are wanted in the stage "fresh seeds".
        failed: of the finished ones.
        broken: of the finished ones, those that break a condition.
        nearest: what the trial that comes nearest to meeting all conditions lacks; empty as soon as
            one meets them.
        lost: what the best trial so far has lost that the start has, such as coverage.
        best: the best score so far of those that meet all conditions, NaN before there is one.
        start: score of the start.
        trials_per_hour: at the pace of the last ones; 0 before that can be known.
        seconds_left: until the end, scoring the best again included; NaN before that can be known.
        facts: what the method tells of itself.
        doing: what the trial at hand is at, where it is worked out in this process.
    """

    stage: str
    done: int
    total: int
    failed: int
    best: float
    start: float
    trials_per_hour: float
    seconds_left: float
    facts: dict[str, Any] = field(default_factory=dict)
    doing: str = ""
    broken: int = 0
    nearest: str = ""
    lost: tuple[str, ...] = ()


@dataclass(frozen=True)
class SearchResult:
    """What came of a study.

    Attributes:
        study: with all its trials; can be run again to go on.
        interrupted: whether it was stopped before its end.
        ended: why it ended.
        notes: what the user should know.
    """

    study: Study
    interrupted: bool
    ended: str
    notes: tuple[str, ...] = ()

    @property
    def best(self) -> Trial:
        """The best trial, by fresh seeds where they were scored.

        Raises:
            SearchError: none succeeded.
        """
        return self.study.trial("best")

    @property
    def start(self) -> Trial:
        """The design as it is, or the nearest to it in the space.

        Raises:
            SearchError: it has not been scored.
        """
        return self.study.trial("start")

    @property
    def trials(self) -> list[Trial]:
        """All finished trials, the start first."""
        return self.study.trials

    @property
    def front(self) -> list[Trial]:
        """The trials that no other one beats in all objectives."""
        return self.study.front


SearchProgressCallback = Callable[[SearchProgress], None]
"""Called a few times a second while a study runs."""
