"""Positions of trials in the figures of a page, so that the page can respond to a pointer."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from optisense.report import _study_tables as tables
from optisense.report._pictures import data_uri, figure_uri
from optisense.search.study.study import Study
from optisense.search.study.trial import Trial
from optisense.text import argument, visible

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST_SELECTABLE = 1000
"""Largest number of trials in the data of the figures, the best ones; each takes some 300 bytes of
the page and 20 of each panel.
"""

MOST_VALUES = 12
"""Largest number of parameters that are shown for a trial, those with the strongest association
with the score.
"""

Place = tuple[int, float, float]
"""Number of a trial, and its position in a figure, as shares of the width from the left and of the
height from the top.
"""


@dataclass
class Marks:
    """Trials that a figure shows.

    Attributes:
        drawn: axes, numbers (n,) of trials, and positions (n, 2) in the units of the axes.
    """

    drawn: list[tuple[Axes, NDArray[np.int64], NDArray[np.float64]]] = field(default_factory=list)

    def add(self, axes: Axes, numbers: ArrayLike, x: ArrayLike, y: ArrayLike) -> None:
        """Record trials that were plotted.

        Args:
            numbers: numbers (n,) of the trials.
            x, y: positions (n,) in the units of the axes.
        """
        places = np.column_stack([np.asarray(x, dtype=float), np.asarray(y, dtype=float)])
        self.drawn.append((axes, np.asarray(numbers, dtype=np.int64), places))

    def places(self, figure: Figure, of: set[int]) -> list[Place]:
        """Return the positions of trials in a drawn figure; those outside its axes are left out."""
        found: list[Place] = []
        for axes, numbers, places in self.drawn:
            inside = axes.bbox.padded(2.0)
            for number, (x, y) in zip(
                numbers.tolist(), axes.transData.transform(places).tolist(), strict=True
            ):
                if number in of and inside.contains(x, y):
                    across, up = x / figure.bbox.width, y / figure.bbox.height
                    found.append((number, round(across, 4), round(1.0 - up, 4)))
        return found


@dataclass(frozen=True)
class TrialFigure:
    """Figure of a page, and the trials in it.

    Attributes:
        uri: picture of the figure.
        places: positions of the trials.
    """

    uri: str
    places: list[Place]

    @staticmethod
    def of(figure: Figure, marks: Marks, of: set[int]) -> TrialFigure:
        """Draw a figure.

        Args:
            figure: figure before it is drawn.
            of: numbers of the trials that the page knows.
        """
        address = figure_uri(figure)  # this also computes its layout
        return TrialFigure(address, marks.places(figure, of))


def selectable(trials: Sequence[Trial]) -> list[Trial]:
    """Return the trials in the data of the figures: all, or the best of very many."""
    if len(trials) <= MOST_SELECTABLE:
        return list(trials)

    def merit(trial: Trial) -> tuple[bool, float]:
        known = math.isfinite(trial.score)
        return trial.is_start, trial.score if known else -math.inf

    return sorted(trials, key=merit, reverse=True)[:MOST_SELECTABLE]


def page_data(
    study: Study,
    trials: Sequence[Trial],
    strongest: Sequence[int],
    pictures: Mapping[int, NDArray[np.uint8]],
    named: str | None,
) -> dict[str, Any]:
    """Return the data of trials for the page, ready for JSON.

    Args:
        strongest: indices of the parameters by the strength of their association with the score.
        pictures: pictures (h, w, 3) of some trials, by number.
        named: the study's folder as the user names it; None takes the folder's own name.
    """
    folder = named or ("STUDY" if study.folder is None else study.folder.name)
    names = study.space.names
    shown = list(strongest[:MOST_VALUES]) or list(range(min(len(names), MOST_VALUES)))
    return {
        "command": f"optisense apply {argument(folder)} --trial",
        "objectives": list(study.settings.names),
        "parameters": [names[number] for number in shown],
        "trials": {
            trial.number: {
                "start": trial.is_start,
                "scores": [
                    tables.number(trial.scores.get(name, math.nan)) for name in study.settings.names
                ],
                "values": [tables.value_text(trial.values[names[number]]) for number in shown],
                "failure": visible(trial.failure or ""),
            }
            for trial in trials
        },
        "pictures": {number: data_uri(each) for number, each in pictures.items()},
    }
