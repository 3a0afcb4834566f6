"""The outcome of one trial of a search."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from optisense.objectives.registry import CONDITIONS
from optisense.search.evaluation.requirements import total_violation

Rank = tuple[int, float]
"""Rank of an outcome, for comparison: of two outcomes the one with the larger rank is better."""

FAILED: Rank = (-2, 0.0)
"""The rank of an outcome without a score, below all others."""


@dataclass(frozen=True)
class Outcome:
    """The scores of one design.

    Attributes:
        scores: score by the name of each objective, higher is better; NaN where there is none.
        failure: reason why a score or the value of a limited quantity is missing, or None.
        parts: components of the scores, by objective, ready for JSON; the entry `CONDITIONS` holds
            the value of the limited quantity of each condition of the search, by the condition's
            text.
        seconds: wall time of the trial, s.
        gradient: gradient (n,) of the first objective by the coordinates, if a method asks for it.
        worker: name of the process that scored the trial.
    """

    scores: Mapping[str, float]
    failure: str | None = None
    parts: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    seconds: float = 0.0
    gradient: NDArray[np.float64] | None = field(default=None, compare=False)
    worker: str = ""

    @property
    def failed(self) -> bool:
        """Whether any score, or the value of a limited quantity, is missing."""
        return self.failure is not None

    def lacking(self, names: Iterable[str]) -> list[str]:
        """Return those of these objectives that have no score."""
        return [name for name in names if not math.isfinite(self.scores.get(name, math.nan))]

    @property
    def unmeasured(self) -> list[str]:
        """Objectives without a score, and conditions whose limited quantity has no value."""
        limits = [text for text, value in self.conditions.items() if value is None]
        return [*self.lacking(self.scores), *limits]

    @property
    def conditions(self) -> Mapping[str, float | None]:
        """Value of the limited quantity by the text of each condition; None where it has none."""
        return self.parts.get(CONDITIONS, {})

    @cached_property
    def violation(self) -> float:
        """Sum of the violations of all conditions (see `total_violation`); 0 if all are met."""
        return total_violation(self.conditions)

    @property
    def is_feasible(self) -> bool:
        """Whether no condition is broken."""
        return self.violation == 0.0

    @staticmethod
    def of_failure(objectives: list[str], reason: str, seconds: float = 0.0) -> Outcome:
        """Return an outcome without scores, with the reason for it."""
        return Outcome(dict.fromkeys(objectives, math.nan), reason, seconds=seconds)


def rank_of(outcome: Outcome, objective: str) -> Rank:
    """Return the rank of an outcome by one objective, by the rules in `requirements`."""
    if outcome.lacking([objective]):
        return FAILED
    return (0, outcome.scores[objective]) if outcome.is_feasible else (-1, -outcome.violation)
