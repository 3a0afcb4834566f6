"""Experiment on robustness: which conclusions of the paper depend on assumed dimensions.

Each dimension of a sensor that no source gives is set to both ends of its plausible range, one at
a time; then all of them are drawn at random. In each of these geometries, a conclusion has a margin
and holds if the margin is above 0. The noise of a margin is its standard deviation over seeds on
the sensor as assumed; a margin is inconclusive if a t test can't tell it from 0.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from paper.claims import Claim, Table
from paper.experiment import Experiment, Finding, Pictures, Steps, Values
from paper.figures import finish
from paper.robustness_questions import CONCLUSIONS, QUESTIONS, Question
from paper.spread import CONFIDENCE, exceeds, number, quantile, spread
from paper.unit import Unit

if TYPE_CHECKING:
    from matplotlib.figure import Figure

AS_ASSUMED = "as assumed"


def geometries(ranges: Mapping[str, Sequence[float]], draws: int) -> dict[str, dict[str, Any]]:
    """Return the dimensions of each geometry by its name, the one as assumed first.

    Args:
        ranges: lowest and highest plausible value of each dimension, in the dimension's unit.
        draws: number of geometries in which all dimensions are drawn from uniform distributions.
    """
    found: dict[str, dict[str, Any]] = {AS_ASSUMED: {}}
    for name, ends in ranges.items():
        for end in ends:
            found[f"{name} {end:g}"] = {name: float(end)}
    for draw in range(draws):
        rng = np.random.default_rng([draw, 7])
        found[f"all drawn, {draw + 1}"] = {
            name: round(float(rng.uniform(low, high)), 3) for name, (low, high) in ranges.items()
        }
    return found


def steps(settings: Values) -> Steps:
    """Evaluate all questions for all geometries, and the geometry as assumed with all seeds."""
    asked: list[tuple[Question, str, list[Unit]]] = []
    for question in QUESTIONS:
        ranges = settings["ranges"][question.sensor]
        for name, dimensions in geometries(ranges, settings["draws"]).items():
            count = settings["seeds"] if name == AS_ASSUMED and question.has_chance else 1
            for seed in range(count):
                units = question.units(dimensions, settings, seed)
                own = [
                    Unit(u.work, u.inputs, f"{question.sensor}, {name}: {u.label}") for u in units
                ]
                asked.append((question, name, own))
    records = iter((yield [unit for _, _, units in asked for unit in units]))
    margins: dict[str, dict[str, list[float | None]]] = {name: {} for name in CONCLUSIONS}
    for question, geometry, units in asked:
        found = question.margins([next(records) for _ in units], settings)
        for name in question.conclusions:
            margins[name].setdefault(geometry, []).append(found[name])
    return Finding({"margins": {name: with_verdicts(rows) for name, rows in margins.items()}})


def with_verdicts(rows: Mapping[str, list[float | None]]) -> Values:
    """Return the margin as assumed with its noise, and margin and verdict of each geometry."""
    nominal = spread(rows[AS_ASSUMED])
    count = sum(value is not None for value in nominal["values"])
    noise = nominal["standard_deviation"]
    least = quantile(count - 1) * noise if noise else 0.0
    verdicts: dict[str, Any] = {}
    for geometry, values in rows.items():
        value = values[0]
        holds = None if value is None or abs(value) <= least else value > 0.0
        verdicts[geometry] = {"margin": value, "holds": holds}
    verdicts[AS_ASSUMED] = {"margin": nominal["mean"], "holds": exceeds(nominal, 0.0)}
    return {"as_assumed": nominal, "geometries": verdicts}


def claims(numbers: Values) -> list[Claim]:
    """Return one statement for each conclusion, which agrees if it holds in all geometries, and
    disagrees if it fails in all.
    """
    return [_claim(CONCLUSIONS[name], found) for name, found in numbers["margins"].items()]


def _claim(text: str, found: Values) -> Claim:
    """Return a conclusion with its verdict over all geometries."""
    verdicts = {name: each["holds"] for name, each in found["geometries"].items()}
    holding = [name for name, holds in verdicts.items() if holds]
    failing = [name for name, holds in verdicts.items() if holds is False]
    unsure = [name for name, holds in verdicts.items() if holds is None]
    here = f"holds in {len(holding)} of {len(verdicts)} geometries"
    if failing:
        here += f"; does not hold for: {', '.join(failing)}" if holding else ""
    if unsure:
        here += f"; within the noise or without a score: {', '.join(unsure)}"
    different = set(verdicts.values())
    return Claim(text, here, different.pop() if len(different) == 1 else None, _why(verdicts))


def _why(verdicts: Mapping[str, bool | None]) -> str:
    """Return why a statement does not hold in all geometries."""
    found = list(verdicts.values())
    unsure = found.count(None)
    decided = (
        "The statement depends on assumed dimensions."
        if True in found
        else "The statement holds for none of these values of the assumed dimensions, so that "
        "another cause explains the difference."
    )
    if not unsure:
        return decided
    open_ones = f"{unsure} of {len(found)}" if unsure < len(found) else f"all {unsure}"
    text = f"In {open_ones} geometries, the margin is within its noise or there is no score."
    if False not in found:
        return text
    return f"{text} {decided}" if True in found else f"{text} In the others, the statement fails."


def notes(numbers: Values) -> list[str]:
    """Return a paragraph that explains geometries and margins."""
    return [
        "A geometry is the sensor with one assumed dimension at an end of its plausible range, or "
        "with random values of all of them. A statement agrees if it holds in all geometries, "
        "disagrees if it fails in all, and is inconclusive otherwise. It neither holds nor fails "
        "where its margin is within the noise or it has no score. A margin is the amount by which "
        "a statement holds, and is negative if it fails. Its noise is the standard deviation over "
        "the seeds of the sensor as assumed. A margin of one seed is within the noise if it is "
        "smaller than the noise "
        f"times the {100 * CONFIDENCE:.0f} % quantile of the t distribution, which is "
        f"{quantile(2):.1f} for three seeds."
    ]


def tables(numbers: Values) -> list[Table]:
    """Return tables of the margins of the conclusions that each question is about."""
    found = []
    for question in QUESTIONS:
        names = list(question.conclusions)
        columns = [numbers["margins"][name] for name in names]
        rows = [
            [geometry, *(_cell(column["geometries"][geometry]) for column in columns)]
            for geometry in columns[0]["geometries"]
        ]
        noise = [c["as_assumed"]["standard_deviation"] for c in columns]
        rows.append(["noise", *("none" if one is None else number(one, 2) for one in noise)])
        found.append(Table(f"Margins, {question.title}", ["geometry", *names], rows))
    return found


def _cell(each: Values) -> str:
    """Return the margin and verdict of one geometry as text."""
    mark = {True: "holds", False: "does not hold", None: "inconclusive"}[each["holds"]]
    return "no score" if each["margin"] is None else f"{each['margin']:+.3g} ({mark})"


def draw(numbers: Values, pictures: Pictures) -> Figure:
    """Draw each margin, in units of the largest margin of its conclusion."""
    from optisense.figures import AMBER, BLUE, GREY, RED, new_figure

    figure = new_figure(10.0, 4.6)
    axes = figure.subplots()
    for row, (_, found) in enumerate(numbers["margins"].items()):
        there = {n: e for n, e in found["geometries"].items() if e["margin"] is not None}
        scale = max((abs(each["margin"]) for each in there.values()), default=0.0) or 1.0
        for name, each in there.items():
            colour = {True: BLUE, False: RED, None: GREY}[each["holds"]]
            mark = "D" if name == AS_ASSUMED else "o"
            axes.plot(each["margin"] / scale, row, mark, color=colour, markersize=6, alpha=0.8)
    axes.axvline(0.0, color=AMBER)
    axes.set_yticks(range(len(numbers["margins"])), list(numbers["margins"]))
    axes.invert_yaxis()
    finish(
        axes,
        "Blue: the conclusion holds in this geometry; red: it does not; diamond: as assumed",
        "margin, in units of the largest",
    )
    return figure


EXPERIMENT = Experiment(
    name="robustness",
    title="Robustness of the conclusions",
    about="which conclusions hold for other values of the assumed dimensions, and which do not",
    steps=steps,
    claims=claims,
    tables=tables,
    draw=draw,
    notes=notes,
)
