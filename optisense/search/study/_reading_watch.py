"""Reading of the best design so far, in long searches whose own trials are not read.

Trials by RGB2Normal and the like are read for nearly nothing, as they have the presses
(`optisense.search.evaluation.evaluator`). Trials by chief rays, over thousands of colours, or over
manufactured sensors are not: there, only the start and the best design so far are read, a few
times.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import fields, replace
from typing import Any

from optisense.errors import OptiSenseError
from optisense.objectives import Settings
from optisense.objectives.named import named_in
from optisense.objectives.registry import WATCHED
from optisense.search.evaluation.evaluator import READING, DesignEvaluator
from optisense.search.evaluation.outcome import Outcome
from optisense.search.study._tally import Tally
from optisense.search.study.study import Study

FIRST_SECONDS = 60.0
"""Time (s) of a search after which its best design is read for the first time. It is read again
whenever the search has taken twice as long as at the last time, so that a reading of 5 s takes less
than a tenth of the search."""


class ReadingWatch:
    """Reads the start and the best design so far of a study, and stores that with their trials."""

    def __init__(self, study: Study, tally: Tally, usual: DesignEvaluator, *, front: bool) -> None:
        """Store the study, which is not read if it has a `front`, and its evaluator of plain
        scores.
        """
        self._study, self._tally, self._usual = study, tally, usual
        texts = [goal for goal in usual.goals if isinstance(goal, str)]
        texts += [each.quantity for each in usual.requirements]
        self._wanted = not front and usual.renders and READING not in named_in(texts)
        self._began = time.monotonic()
        self._due = self._began + FIRST_SECONDS
        self._reader: DesignEvaluator | None = None

    def update(self, *, last: bool = False) -> None:
        """Read the start and the best design, if they were not read before and it is time to, or if
        the trials have ended and the search was long.
        """
        now = time.monotonic()
        due = self._began + FIRST_SECONDS if last else self._due
        if not self._wanted or now < due:
            return
        for number, outcome in self._tally.leading():
            known: Mapping[str, Any] = outcome.parts.get(WATCHED, {})
            if READING in known:
                continue
            value = self._read(number)
            if value is None:  # the start or the best can't be read, so nothing can be compared
                self._wanted = False
                return
            watched = {**known, READING: value}
            parts = {**outcome.parts, WATCHED: watched}
            self._study.store.add_parts(number, parts)
            self._tally.replace(number, replace(outcome, parts=parts))
            self._due = now + (now - self._began)

    def _read(self, number: int) -> float | None:
        """Return the error of normals (degrees) of a trial's design, or None if there is none."""
        study = self._study
        if self._reader is None:
            shared = {field.name for field in fields(Settings)}
            given = {k: v for k, v in study.settings.settings.items() if k in shared}
            self._reader = DesignEvaluator(
                study.space,
                [READING],
                {"photons": "normal", **given},
                keeps=False,
                variant=self._usual.variant,
            )
        row = next(each for each in study.store.rows() if each.number == number)
        try:
            found: Outcome = self._reader.evaluate(
                study.space.apply(row.vector), study.settings.seed
            )
        except OptiSenseError:
            return None
        return None if found.failed else -next(iter(found.scores.values()))
