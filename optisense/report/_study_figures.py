"""Figures of a study: its convergence, the influence of its parameters, and its trade-offs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from optisense.array_types import FloatArray
from optisense.design import SensorDesign
from optisense.design.section import section
from optisense.figures import AMBER, BLUE, GREY, PALE, RED, new_figure
from optisense.report._pictures import legend_above
from optisense.search.space.parameters import Choice
from optisense.search.study.best import start_of
from optisense.search.study.trial import Trial

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from optisense.report._trial_marks import Marks

MOST_PANELS = 12
"""Largest number of parameters drawn: those with the strongest association with the score."""

COLUMNS = 4
"""Number of panels side by side in a figure; their labels stay readable at the page's width."""
MOST_NUMBERED = 8
"""Largest number of trials of a front that are labelled with their number."""

LONGEST = 34
"""Largest number of letters of a parameter's name that fit above a small panel."""


@dataclass(frozen=True)
class Influence:
    """Association of a score with one parameter over the trials of a study.

    Attributes:
        number: index of the parameter.
        strength: strength, 0 to 1: for numbers the absolute value of Spearman's rank correlation,
            for choices the correlation ratio (the root of the share of the variance that lies
            between the options).
    """

    number: int
    strength: float


def convergence(
    trials: Sequence[Trial], names: Sequence[str], marks: Marks | None = None
) -> Figure:
    """Draw scores in the order of the trials, and the best so far; one panel per objective.

    Args:
        marks: record of the positions of trials in the figure.
    """
    figure = new_figure(9.5, 0.6 + 2.7 * len(names))
    start = start_of(trials)
    later = [trial for trial in trials if not trial.is_start]
    panels = figure.subplots(len(names), 1, squeeze=False, sharex=True)[:, 0]
    for axes, name in zip(panels, names, strict=True):
        numbers = np.array([trial.number for trial in later], dtype=float)
        scores = np.array([trial.scores.get(name, np.nan) for trial in later])
        known = np.isfinite(scores)
        axes.plot(numbers[known], scores[known], ".", color=BLUE, ms=4, alpha=0.45, label="a trial")
        if known.any():
            best = np.fmax.accumulate(scores)
            axes.step(numbers, best, where="post", color=RED, lw=1.6, label="best so far")
        if start is not None and np.isfinite(start.scores.get(name, np.nan)):
            axes.axhline(start.scores[name], color=GREY, lw=1.2, ls="--", label="the start")
        _limits(axes, scores[known])
        if (~known).any():
            lowest = axes.get_ylim()[0]
            axes.plot(
                numbers[~known],
                np.full((~known).sum(), lowest),
                "x",
                color=AMBER,
                ms=5,
                clip_on=False,
                label="failed",
            )
            if marks is not None:
                marks.add(axes, numbers[~known], numbers[~known], np.full((~known).sum(), lowest))
        if marks is not None:
            marks.add(axes, numbers[known], numbers[known], scores[known])
        axes.set_ylabel(name)
        axes.grid(alpha=0.25)
        legend_above(axes, columns=4)
    panels[-1].set_xlabel("trial")
    panels[-1].xaxis.get_major_locator().set_params(integer=True)
    return figure


def influences(trials: Sequence[Trial], name: str) -> list[Influence]:
    """Return the association of a score with each parameter, strongest first, without failures."""
    known = [trial for trial in trials if np.isfinite(trial.scores.get(name, np.nan))]
    if len(known) < 3:
        return []
    points = np.array([trial.vector for trial in known])
    scores = np.array([trial.scores[name] for trial in known])
    found = []
    for number, parameter in enumerate(known[0].space.parameters):
        column = points[:, number]
        if isinstance(parameter.kind, Choice):
            strength = correlation_ratio(column, scores)
        else:
            strength = abs(rank_correlation(column, scores))
        found.append(Influence(number, strength))
    return sorted(found, key=lambda each: -each.strength)


def rank_correlation(one: ArrayLike, other: ArrayLike) -> float:
    """Return Spearman's rank correlation of two samples (n,); 0 if one of them is constant."""
    first, second = _ranks(one), _ranks(other)
    if np.ptp(first) == 0.0 or np.ptp(second) == 0.0:
        return 0.0
    return float(np.corrcoef(first, second)[0, 1])


def _ranks(values: ArrayLike) -> NDArray[np.float64]:
    """Return the ranks (n,) of values (n,), from 1; equal values have the mean of their ranks.

    `scipy.stats`, which has this too, takes a second to load.
    """
    _, which, counts = np.unique(np.asarray(values), return_inverse=True, return_counts=True)
    return np.asarray((np.cumsum(counts) - (counts - 1) / 2)[which])


def correlation_ratio(groups: ArrayLike, values: ArrayLike) -> float:
    """Return the correlation ratio (eta) of values (n,) in groups (n,): the root of the share of
    their variance that lies between the groups; 0 if they are constant.
    """
    member, given = np.asarray(groups), np.asarray(values, dtype=np.float64)
    total = float(((given - given.mean()) ** 2).sum())
    if total == 0.0:
        return 0.0
    means = [(given[member == each].mean(), (member == each).sum()) for each in np.unique(member)]
    between = sum(count * (mean - given.mean()) ** 2 for mean, count in means)
    return float(np.sqrt(between / total))


def parameters(
    trials: Sequence[Trial], name: str, best: Trial | None, marks: Marks | None = None
) -> Figure | None:
    """Draw the score against the parameters with the strongest association; None if there are too
    few trials.

    Args:
        marks: record of the positions of trials in the figure.
    """
    chosen = influences(trials, name)[:MOST_PANELS]
    if not chosen:
        return None
    known = [trial for trial in trials if np.isfinite(trial.scores.get(name, np.nan))]
    points = np.array([trial.vector for trial in known])
    scores = np.array([trial.scores[name] for trial in known])
    order = np.array([trial.number for trial in known])
    columns = min(COLUMNS, len(chosen))
    rows = -(-len(chosen) // columns)
    figure = new_figure(2.9 * columns + 0.8, 2.4 * rows + 0.4)
    panels = figure.subplots(rows, columns, squeeze=False, sharey=True).ravel()
    spread = np.random.default_rng(0).uniform(-0.18, 0.18, len(known))
    for axes, each in zip(panels, chosen, strict=False):
        parameter = known[0].space.parameters[each.number]
        column = points[:, each.number]
        across = column + spread if isinstance(parameter.kind, Choice) else column
        if marks is not None:
            marks.add(axes, order, across, scores)
        if isinstance(parameter.kind, Choice):
            shown = axes.scatter(
                across, scores, c=order, s=6, cmap="viridis", alpha=0.5, linewidths=0
            )
            options = np.unique(column)
            means = [scores[column == option].mean() for option in options]
            axes.plot(options, means, "_", color=RED, ms=22, mew=2)
            labels = [_short(label, 12) for label in parameter.kind.labels]
            axes.set_xticks(range(len(labels)), labels, fontsize=7)
        else:
            shown = axes.scatter(
                column, scores, c=order, s=8, cmap="viridis", alpha=0.6, linewidths=0
            )
            axes.axvline(parameter.start, color=GREY, lw=1, ls="--")
            axes.locator_params(axis="x", nbins=5)
        if best is not None:
            axes.axvline(best.vector[each.number], color=RED, lw=1)
        axes.set_title(f"{_short(parameter.name, LONGEST)}\n{each.strength:.2f}", fontsize=8)
        axes.tick_params(labelsize=7)
        axes.grid(alpha=0.2)
        _limits(axes, scores)
    for axes in panels[len(chosen) :]:
        axes.set_visible(False)
    for row in range(rows):
        panels[row * columns].set_ylabel(name, fontsize=8)
    figure.colorbar(shown, ax=panels.tolist(), label="trial", fraction=0.02, pad=0.01)
    return figure


def front(
    trials: Sequence[Trial],
    chosen: Sequence[Trial],
    names: Sequence[str],
    best: Trial | None,
    marks: Marks | None = None,
) -> Figure:
    """Draw two objectives against each other, with the Pareto front.

    Args:
        marks: record of the positions of trials in the figure.
    """
    one, other = names[:2]
    values = np.array([[trial.scores[one], trial.scores[other]] for trial in trials])
    known = np.isfinite(values).all(axis=1)
    numbers = np.array([trial.number for trial in trials])[known]
    values = values[known]
    edge = np.array(sorted((trial.scores[one], trial.scores[other]) for trial in chosen))
    figure = new_figure(7.5, 5.0)
    axes = figure.subplots()
    axes.plot(*values.T, ".", color=PALE, ms=5, label="trials", zorder=1)
    if marks is not None:
        marks.add(axes, numbers, *values.T)
    if len(edge):
        label = "Pareto front"
        style = "o-" if len(names) == 2 else "o"
        axes.plot(
            *edge.T, style, color=BLUE, ms=5, lw=1.2, drawstyle="steps-pre", label=label, zorder=3
        )
    start = start_of(trials)
    for each in spread_out(chosen, one, MOST_NUMBERED):
        axes.annotate(
            str(each.number),
            (each.scores[one], each.scores[other]),
            (5, 5),
            textcoords="offset points",
            fontsize=8,
            color=BLUE,
        )
    special = ((start, GREY, "s", "the start"), (best, RED, "*", f"best by {one}"))
    for trial, colour, mark, label in special:
        if trial is not None and np.isfinite([trial.scores[one], trial.scores[other]]).all():
            size = 14 if mark == "*" else 7
            axes.plot(
                trial.scores[one],
                trial.scores[other],
                mark,
                color=colour,
                ms=size,
                mec="white",
                label=label,
                zorder=4,
                ls="",
            )
    _limits(axes, values[:, 0], horizontal=True)
    _limits(axes, values[:, 1])
    axes.set_xlabel(f"{one} (higher is better)")
    axes.set_ylabel(f"{other} (higher is better)")
    axes.grid(alpha=0.25)
    legend_above(axes, columns=4)
    return figure


def spread_out(trials: Sequence[Trial], name: str, most: int) -> list[Trial]:
    """Return at most `most` trials, from the lowest score of a name to the highest."""
    if not trials:
        return []
    ordered = sorted(trials, key=lambda trial: trial.scores[name])
    places = np.linspace(0, len(ordered) - 1, min(most, len(ordered))).round()
    return [ordered[place] for place in sorted({int(place) for place in places})]


def sections(before: SensorDesign, after: SensorDesign) -> Figure:
    """Draw the outlines of two designs in one section, in the frame of the first."""
    low, high = section(before).bounds
    figure = new_figure(
        8.5, float(np.clip(7.0 * (high - low)[1] / (high - low)[0], 2.0, 6.0)) + 0.6
    )
    axes = figure.subplots()
    for design, colour, style, width, label in (
        (before, GREY, "--", 1.1, "before"),
        (after, BLUE, "-", 1.4, "after"),
    ):
        found = section(design)
        for outline in found.outlines:
            for line in outline.lines:
                axes.plot(*line.T, color=colour, ls=style, lw=width)
        for name, spots in found.lights.items():
            axes.plot(*spots.T, "o", ms=4, mfc=found.colours[name], mec=colour, mew=1.0)
        axes.plot(*found.camera, "s", ms=6, color=colour)
        axes.plot([], [], color=colour, ls=style, label=label)
    # Axes of a fixed shape would be moved after the layout has made room for the labels.
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel("mm")
    axes.set_ylabel("mm, along the camera's view")
    legend_above(axes)
    return figure


def _limits(axes: Axes, values: FloatArray, horizontal: bool = False) -> None:
    """Set limits so that few very bad scores do not squeeze the others; they may lie outside."""
    if len(values) < 2:
        return
    low, middle, high = np.quantile(values, [0.0, 0.25, 1.0]).tolist()
    if high - low > 4.0 * (high - middle) > 0.0:
        low = high - 4.0 * (high - middle)
    room = 0.06 * (high - low) or 0.5
    (axes.set_xlim if horizontal else axes.set_ylim)(low - room, high + room)


def _short(text: str, most: int) -> str:
    return text if len(text) <= most else "…" + text[1 - most :]
