"""A trial of a study: one point of its space and what came of it."""

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
from optisense.search.evaluation.requirements import breach_of
from optisense.search.space.search_space import BoundSpace


@dataclass(frozen=True)
class Trial:
    """A finished trial.

    Attributes:
        number: counts from 0, the start.
        generation: which it was proposed in; -1 for the start.
        vector: (n,) the point.
        outcome: scores with the seed of the study.
        fresh: scores with other seeds, by seed; only of the best trials.
        space: what the point means.
        objective: the first goal.
    """

    number: int
    generation: int
    vector: NDArray[np.float64]
    outcome: Outcome
    space: BoundSpace = field(repr=False)
    objective: str = ""
    fresh: Mapping[int, Outcome] = field(default_factory=dict, repr=False)

    @property
    def is_start(self) -> bool:
        """Whether this is the design as it is, or the nearest to it in the space."""
        return self.generation < 0

    @property
    def scores(self) -> Mapping[str, float]:
        """Score by each objective; NaN where it failed."""
        return self.outcome.scores

    @property
    def score(self) -> float:
        """Score by the first objective, with the seed of the study."""
        return self.outcome.scores.get(self.objective, math.nan)

    @property
    def failure(self) -> str | None:
        """Why a score is missing."""
        return self.outcome.failure

    @property
    def parts(self) -> Mapping[str, Mapping[str, Any]]:
        """What the scores are made of, by objective."""
        return self.outcome.parts

    @property
    def conditions(self) -> Mapping[str, float | None]:
        """The value of the limited quantity, by the text of each condition of the study.

        Means over fresh seeds where the trial was scored with these, as of its score.
        """
        if not self.fresh:
            return self.outcome.conditions
        again = [outcome.conditions for outcome in self.fresh.values()]
        return {text: _mean([each.get(text) for each in again]) for text in again[0]}

    @property
    def breach(self) -> float:
        """How far it breaks the conditions of the study; 0 where it meets them."""
        return breach_of(self.conditions) if self.fresh else self.outcome.breach

    @property
    def is_feasible(self) -> bool:
        """Whether it meets all conditions of the study."""
        return self.breach == 0.0

    @property
    def values(self) -> dict[str, float | int | str]:
        """What it sets, by parameter."""
        return self.space.values(self.vector)

    @property
    def design(self) -> SensorDesign:
        """The design of this trial; a new one each time."""
        return self.space.apply(self.vector).copy()

    def fresh_score(self, objective: str | None = None) -> float:
        """Mean over the other seeds; NaN if there is none or one failed."""
        name = objective or self.objective
        values = [outcome.scores.get(name, math.nan) for outcome in self.fresh.values()]
        return float(np.mean(values)) if values else math.nan

    @property
    def fair_score(self) -> float:
        """Score by the first objective, by fresh seeds where they were scored.

        The score by the study's seed, by which a trial was chosen, is too high on average.
        """
        fresh = self.fresh_score()
        return fresh if math.isfinite(fresh) else self.score

    def fresh_spread(self, objective: str | None = None) -> float:
        """Standard deviation over the other seeds; NaN if there are less than two."""
        name = objective or self.objective
        values = [outcome.scores.get(name, math.nan) for outcome in self.fresh.values()]
        return deviation_of(values) if np.isfinite(values).all() else math.nan


def _mean(values: Sequence[float | None]) -> float | None:
    """The mean; None where one was not measured."""
    known = [value for value in values if value is not None]
    return float(np.mean(known)) if len(known) == len(values) else None
