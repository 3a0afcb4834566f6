"""A trial of a study: one point of its space and its outcome."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from optisense.design import SensorDesign
from optisense.objectives.score import deviation_of
from optisense.search.evaluation.outcome import Outcome
from optisense.search.evaluation.requirements import total_violation
from optisense.search.space.search_space import BoundSpace


@dataclass(frozen=True)
class Trial:
    """A finished trial.

    Trials are equal if they are the same trial of a study, whatever is known of its outcome.

    Attributes:
        number: number of the trial, from 0, the start.
        generation: generation that it was proposed in; -1 for the start.
        vector: point (n,) of the space.
        outcome: outcome with the seed of the study.
        fresh: outcomes with other seeds, by seed; only for the best trials.
        space: space of the point.
        objective: first goal.
        is_newer: whether it was proposed after the best trials were last scored with fresh seeds.
    """

    number: int
    generation: int
    vector: NDArray[np.float64] = field(compare=False)
    outcome: Outcome = field(compare=False)
    space: BoundSpace = field(repr=False)
    objective: str = ""
    fresh: Mapping[int, Outcome] = field(default_factory=dict, repr=False, compare=False)
    is_newer: bool = field(default=False, compare=False)

    @property
    def is_start(self) -> bool:
        """True for the starting design, or the nearest point to it in the space."""
        return self.generation < 0

    @property
    def scores(self) -> Mapping[str, float]:
        """Score by each objective; NaN if it failed."""
        return self.outcome.scores

    @property
    def score(self) -> float:
        """Score by the first objective, with the seed of the study."""
        return self.outcome.scores.get(self.objective, math.nan)

    @property
    def failure(self) -> str | None:
        """Reason why a score or the value of a limited quantity is missing, or None."""
        return self.outcome.failure

    @property
    def parts(self) -> Mapping[str, Mapping[str, Any]]:
        """Components of the scores, by objective."""
        return self.outcome.parts

    @property
    def conditions(self) -> Mapping[str, float | None]:
        """Value of the limited quantity, by the text of each condition of the study.

        The values are means over fresh seeds if the trial was scored with these, as is its score.
        """
        if not self.fresh:
            return self.outcome.conditions
        again = [outcome.conditions for outcome in self.fresh.values()]
        return {text: _mean([each.get(text) for each in again]) for text in again[0]}

    @property
    def violation(self) -> float:
        """Sum of the violations of the study's conditions; 0 if all are met."""
        return total_violation(self.conditions) if self.fresh else self.outcome.violation

    @property
    def is_feasible(self) -> bool:
        """True if all conditions of the study are met."""
        return self.violation == 0.0

    @property
    def values(self) -> dict[str, float | int | str]:
        """Values of the point, by parameter."""
        return self.space.values(self.vector)

    @property
    def design(self) -> SensorDesign:
        """Design of this trial; a new one each time."""
        return self.space.apply(self.vector).copy()

    def fresh_score(self, objective: str | None = None) -> float:
        """Return the mean score over the fresh seeds; NaN if there are none or one failed."""
        values = self._fresh_scores(objective)
        return float(np.mean(values)) if values else math.nan

    @property
    def unbiased_score(self) -> float:
        """Score by the first objective, by fresh seeds if they were scored.

        The score by the study's seed, by which a trial was chosen, is too high on average.
        """
        fresh = self.fresh_score()
        return fresh if math.isfinite(fresh) else self.score

    def fresh_spread(self, objective: str | None = None) -> float:
        """Return the standard deviation over the fresh seeds; NaN if there are less than two."""
        values = self._fresh_scores(objective)
        return deviation_of(values) if np.isfinite(values).all() else math.nan

    def _fresh_scores(self, objective: str | None) -> list[float]:
        name = objective or self.objective
        return [outcome.scores.get(name, math.nan) for outcome in self.fresh.values()]


def _mean(values: Sequence[float | None]) -> float | None:
    """Return the mean, or None if a value was not measured."""
    known = [value for value in values if value is not None]
    return float(np.mean(known)) if len(known) == len(values) else None
