"""Scores of one sensor with one or several seeds, and their spread."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from optisense.design import SensorDesign
from optisense.json_values import json_ready
from optisense.objectives.evaluation import Evaluation
from optisense.objectives.score import Score, deviation_of


@dataclass(frozen=True)
class Run:
    """The scores of one seed and their shared evaluation; scores may still be added."""

    evaluation: Evaluation
    scores: dict[str, Score]


@dataclass
class Scored:
    """A sensor with its scores, seed by seed.

    Attributes:
        design: the sensor.
        runs: the runs, one per seed.
    """

    design: SensorDesign
    runs: list[Run] = field(default_factory=list)

    def add(self, evaluation: Evaluation) -> dict[str, Score]:
        """Begin a run; scores added to the returned dict are part of it."""
        self.runs.append(Run(evaluation, {}))
        return self.runs[-1].scores

    @property
    def scores(self) -> Mapping[str, Score]:
        """The scores of the first seed."""
        return self.runs[0].scores if self.runs else {}

    def values(self, name: str) -> list[float]:
        """Return the values of one objective, without seeds that failed."""
        found = [run.scores[name] for run in self.runs if name in run.scores]
        return [score.value for score in found if score.failure is None]

    def mean(self, name: str) -> float:
        """Return the mean over seeds, NaN if all failed."""
        values = self.values(name)
        return float(np.mean(values)) if values else float("nan")

    def spread(self, name: str) -> float | None:
        """Return the sample standard deviation over seeds; None for fewer than two."""
        values = self.values(name)
        return deviation_of(values) if len(values) > 1 else None

    def beside(self, name: str) -> str:
        """Return parts to show beside a score, of the first seed, named if there are several."""
        shown = self.scores[name].beside
        if not shown or len(self.runs) == 1:
            return shown
        return f"{shown} (seed {self.runs[0].evaluation.settings.seed})"

    def failed(self) -> bool:
        """Whether any score of any seed failed."""
        return any(s.failure is not None for run in self.runs for s in run.scores.values())

    def to_dict(self) -> dict[str, Any]:
        """Return all values, ready for JSON; the scores are those of the first seed."""
        if not self.runs:
            return {"design": self.design.name, "scores": {}}
        first = self.runs[0].evaluation
        settings = asdict(first.settings)
        settings |= {"resolution": first.resolution, "ray_resolution": first.ray_resolution}
        content = {
            "design": self.design.name,
            "settings": settings,
            "notes": first.notes,
            "scores": {name: score.to_dict() for name, score in self.scores.items()},
            "shared_seconds": first.seconds,
        }
        if len(self.runs) > 1:
            content["seeds"] = {
                name: {
                    "mean": self.mean(name),
                    "standard_deviation": self.spread(name),
                    "values": {
                        str(run.evaluation.settings.seed): run.scores[name].value
                        for run in self.runs
                        if name in run.scores
                    },
                }
                for name in self.scores
            }
        ready: dict[str, Any] = json_ready(content)
        return ready
