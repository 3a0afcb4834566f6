"""Counts of a study's trials, and the best of them."""

from __future__ import annotations

import math
from collections.abc import Sequence

from optisense.errors import SearchError
from optisense.search.evaluation.outcome import Outcome
from optisense.search.study.conditions import unmet, worsened
from optisense.search.study.failures import cause_of, is_defect, is_of_rule, reason_of
from optisense.search.study.store import START, Row

ALL_FAIL = 20
"""Number of first trials that must all fail for a study to stop early, if the starting design has a
score. Where three quarters of the space are forbidden, so many fail by chance once in 300 searches.
"""

ALL_FAIL_WITH_START = 5
"""Number of first trials that must all fail for a study to stop early, if the starting design fails
too; then an error in the set-up is likely.
"""


class Tally:
    """Counts of the finished trials of a study.

    Attributes:
        done, failed, broken: number of finished trials, of those without a score, and of those with
            one that break a condition, each without the start.
        best, start: highest score of a trial that meets all conditions, and score of the start;
            NaN if there is none.
        scored: outcomes with a score by the bytes of their points.
    """

    def __init__(self, weighed: Sequence[str]) -> None:
        """Start with no trials.

        Args:
            weighed: objectives without which a trial is of no use to the search, as without the
                value of a condition. `best` and `start` are scores of the first one.
        """
        self.done = self.failed = self.broken = 0
        self.best = self.start = math.nan
        self.scored: dict[bytes, Outcome] = {}
        self._weighed = weighed
        self._useless = 0
        self._nearest: Outcome | None = None
        self._leading: dict[str, tuple[int, Outcome]] = {}
        self._reasons: dict[str, list[str]] = {}

    def count(self, row: Row, outcome: Outcome) -> None:
        """Count a finished trial; SearchError if the first trials all failed."""
        score = outcome.scores.get(self._weighed[0], math.nan)
        failed = not math.isfinite(score)
        if row.generation == START:
            self.start, self._leading["start"] = score, (row.number, outcome)
        else:
            self.done += 1
            self.failed += failed
            self.broken += not failed and not outcome.is_feasible
            if outcome.lacking(self._weighed) or None in outcome.conditions.values():
                self._useless += 1
                reason = reason_of(outcome)
                self._reasons.setdefault(cause_of(reason), []).append(reason)
        if not failed:
            self.scored[row.vector.tobytes()] = outcome
            if outcome.is_feasible and not score <= self.best:
                self.best, self._leading["best"] = score, (row.number, outcome)
            if self._nearest is None or outcome.violation < self._nearest.violation:
                self._nearest = outcome
        enough = ALL_FAIL_WITH_START if math.isnan(self.start) else ALL_FAIL
        if self._useless == self.done >= enough:
            raise self.all_failed()

    @property
    def has_no_score(self) -> bool:
        """Whether there are trials, but neither they nor the start have a score."""
        return self.done == self._useless > 0 and math.isnan(self.start)

    def all_failed(self) -> SearchError:
        """Return the error for a study in which no trial has a score."""
        reasons = max(self._reasons.values(), key=len)
        return SearchError(
            f"all {self.done} trials so far have failed, {len(reasons)} of them because: "
            f"{reasons[0]}",
            hint=self._way_out(),
        )

    def _way_out(self) -> str:
        """Return what to do if no trial has a score."""
        start = self._leading["start"][1] if "start" in self._leading else None
        causes = [each[0] for each in self._reasons.values()]
        missing = [] if start is None else start.lacking(start.scores)
        if not missing or not all(map(is_defect, causes)):
            return (
                "Change the bounds, or see with `optisense evaluate` whether the design can be "
                "scored at all"
            )
        faulty = "the rule" if is_of_rule(causes[0]) else f"the objective {', '.join(missing)}"
        return f"Repair {faulty}, which failed for every design that was tried, the start included"

    def nearest_note(self) -> str:
        """Return the conditions that the trial nearest to feasibility breaks; "" if feasible."""
        if self._nearest is None or self._nearest.is_feasible:
            return ""
        return ", ".join(unmet(self._nearest.conditions))

    def leading(self) -> list[tuple[int, Outcome]]:
        """Return numbers and outcomes of the start and of the best trial, if that is better."""
        if not self.best > self.start:
            return []  # one of the two is NaN if it has no score
        return [self._leading["start"], self._leading["best"]]

    def replace(self, number: int, outcome: Outcome) -> None:
        """Replace the outcome of the start or of the best trial by one with further parts."""
        for name, (known, _) in self._leading.items():
            if known == number:
                self._leading[name] = number, outcome

    def worsened(self) -> dict[str, str]:
        """Return the watched quantities that are worse in the best trial so far: "0.41 (start
        0.57)".
        """
        leading = self.leading()
        if not leading:
            return {}
        (_, start), (_, best) = leading
        worse = worsened(best, start)
        return {name: f"{now:.3g} (start {was:.3g})" for name, (now, was) in worse.items()}
