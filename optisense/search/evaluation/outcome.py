"""The outcome of one trial of a search."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from optisense.objectives.registry import CONDITIONS
from optisense.search.evaluation.requirements import breach_of

Rank = tuple[int, float]
"""Compares outcomes: a larger one is better."""

FAILED: Rank = (-2, 0.0)
"""The rank of an outcome without a score, below all others."""


@dataclass(frozen=True)
class Outcome:
    """The scores of one design.

    Attributes:
        scores: by objective, higher is better; NaN where there is none.
        failure: why a score is missing, or None.
        parts: what the scores are made of, by objective, ready for JSON; and under `CONDITIONS`
            the value of the limited quantity of each condition of the search, by its text.
        seconds: wall time.
        gradient: (n,) of the first objective by the coordinates, where a method asks for it.
        worker: who worked it out.
    """

    scores: Mapping[str, float]
    failure: str | None = None
    parts: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    seconds: float = 0.0
    gradient: NDArray[np.float64] | None = field(default=None, compare=False)
    worker: str = ""

    @property
    def failed(self) -> bool:
        """Whether a score is missing."""
        return self.failure is not None

    @property
    def conditions(self) -> Mapping[str, float | None]:
        """The value of the limited quantity, by the text of each condition."""
        return self.parts.get(CONDITIONS, {})

    @cached_property
    def breach(self) -> float:
        """How far the conditions are broken in all (see `breach_of`); 0 where all are met."""
        return breach_of(self.conditions)

    @property
    def is_feasible(self) -> bool:
        """Whether no condition is broken."""
        return self.breach == 0.0

    @staticmethod
    def of_failure(objectives: list[str], reason: str, seconds: float = 0.0) -> Outcome:
        """An outcome without scores."""
        return Outcome(dict.fromkeys(objectives, math.nan), reason, seconds=seconds)


def rank_of(outcome: Outcome, objective: str) -> Rank:
    """How an outcome compares with others by one objective, as `requirements` says."""
    score = outcome.scores.get(objective, math.nan)
    if not math.isfinite(score):
        return FAILED
    return (0, score) if outcome.is_feasible else (-1, -outcome.breach)
