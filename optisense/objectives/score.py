"""Scores: the value of one objective for a sensor, its parts and its figure, for several seeds."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from optisense.json_values import json_ready
from optisense.text import to_html

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from optisense.design import SensorDesign
    from optisense.objectives.evaluation import Evaluation

ROUNDING = 1e-9
"""Relative difference below which values count as equal. Scores of the same rays differ by about
1e-15, the rounding of double precision; scores with other random numbers differ by more than
1e-6."""

Drawing = Callable[["Score"], "Figure"]
"""A function that draws the figure of a score."""


@dataclass(frozen=True)
class Score:
    """The result of one objective.

    Attributes:
        objective: name in the registry.
        value: the score; NaN if it failed.
        failure: reason for a missing value, as a sentence without its full stop, or None.
        parts: values that the score is computed from, ready for JSON (see each objective).
        seconds: wall time (s), including work shared with later objectives.
        title: display name of the objective.
        arrays: data of the figure; not part of `to_dict`.
        draw: function that draws the figure.
        shown: names of the parts that are shown beside the value.
        unit: unit of the value; empty for a plain number.
        lower_is_better: whether a lower value is better, as for an error.
    """

    objective: str
    value: float
    failure: str | None = None
    parts: Mapping[str, Any] = field(default_factory=dict)
    seconds: float = 0.0
    title: str = ""
    arrays: Mapping[str, Any] = field(default_factory=dict, repr=False, compare=False)
    draw: Drawing | None = field(default=None, repr=False, compare=False)
    shown: tuple[str, ...] = ()
    unit: str = ""
    lower_is_better: bool = False

    @property
    def name(self) -> str:
        """The title, or the registry's name if there is none."""
        return self.title or self.objective

    @property
    def file_name(self) -> str:
        """The objective's name, with characters that file names can't have replaced by dashes."""
        return re.sub(r"[^\w.+-]+", "-", self.objective).strip("-.") or "score"

    @property
    def beside(self) -> str:
        """The parts to show beside the value, as text: ``coverage 0.53``."""
        return ", ".join(
            f"{key.replace('_', ' ')} {shown_number(self.parts[key])}"
            for key in self.shown
            if key in self.parts
        )

    def figure(self) -> Figure:
        """Draw the parts; objectives without a figure of their own have a plain one."""
        from optisense.objectives._figures import draw_failure, draw_parts

        if self.failure is not None:
            return draw_failure(self)
        return (self.draw or draw_parts)(self)

    def to_dict(self) -> dict[str, Any]:
        """Return everything except figure data, ready for JSON; missing numbers are None."""
        return {
            "objective": self.objective,
            "title": self.name,
            "unit": self.unit,
            "lower_is_better": self.lower_is_better,
            "value": json_ready(self.value),
            "failure": self.failure,
            "seconds": round(self.seconds, 4),
            "parts": json_ready(self.parts),
        }

    def _repr_html_(self) -> str:
        """Return a table for notebooks: the value and all single numbers among the parts."""
        shown = self.failure if self.failure is not None else f"<b>{self.value:.4g}</b>"
        rows = [(self.name, shown if self.failure is None else to_html(str(shown)))]
        for key, value in self.parts.items():
            if isinstance(value, bool | int | float | str):
                rows.append((to_html(key.replace("_", " ")), to_html(shown_number(value))))
        body = "".join(f"<tr><th>{key}</th><td>{value}</td></tr>" for key, value in rows)
        return f"<table>{body}</table>"


def deviation_of(values: Sequence[float]) -> float:
    """Return the standard deviation of a sample.

    It is exactly 0 if all values are equal up to rounding, as for an objective without random
    numbers.

    Args:
        values: finite numbers.

    Returns:
        The deviation, with divisor n - 1; NaN for fewer than two values.
    """
    if len(values) < 2:
        return math.nan
    if np.ptp(values) <= ROUNDING * np.abs(values).max():
        return 0.0
    return float(np.std(values, ddof=1))


def numbers_of(parts: Mapping[str, Any]) -> dict[str, float]:
    """Return the parts of a score that are numbers."""
    return {
        name: float(value)
        for name, value in parts.items()
        if isinstance(value, int | float) and not isinstance(value, bool)
    }


def shown_number(value: float | str) -> str:
    """Format a number with four significant digits; other values are unchanged."""
    return f"{value:.4g}" if isinstance(value, float) else str(value)


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
