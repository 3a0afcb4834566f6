"""Which conclusions of the paper survive a change of the dimensions that we had to assume.

Each dimension of a sensor that no source gives is taken to both ends of its plausible range, one at
a time, and then all of them are drawn at once. In each of these geometries the conclusion is a
margin: above 0 it holds. What the seeds scatter by on the sensor as assumed is the noise of a
margin, and within it nothing can be told.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from optisense.experiments import (
    gelbelt_lights,
    gelsight360,
    gelsight360_claims,
    svelte_mirror,
)
from optisense.experiments.claims import Claim, Table
from optisense.experiments.evaluations import NINE, picture, relit_scores, scores, sensor
from optisense.experiments.experiment import Experiment, Finding, Pictures, Steps, Values
from optisense.experiments.figures import finish
from optisense.experiments.mini_shapes import OBJECTIVES
from optisense.experiments.spread import number, spread
from optisense.experiments.unit import Record, Unit

if TYPE_CHECKING:
    from matplotlib.figure import Figure

AS_ASSUMED = "as assumed"
LOW, HIGH = "0.2", "0.6"
"""Specularities of the Mini's coating that are compared."""

PRESS_DEPTH = "press_depth"
"""mm, of the objectives' balls: not a dimension of the sensor, but the paper gives none."""

TIMES = 2.0
"""AOAP must grow so many times by the search (in the paper: 2.7 times)."""

Dimensions = Mapping[str, Any]
"""Arguments of a sensor's builder."""


@dataclass(frozen=True)
class Question:
    """What is asked of one geometry of a sensor, and the margins that follow.

    Attributes:
        sensor: a built-in one.
        conclusions: what the paper says, by a short name.
        units: of dimensions, settings and a seed.
        margins: by the conclusions' names, of the records of these units.
        has_chance: whether seeds matter.
    """

    sensor: str
    conclusions: Mapping[str, str]
    units: Callable[[Dimensions, Values, int], list[Unit]]
    margins: Callable[[Sequence[Record], Values], dict[str, float | None]]
    has_chance: bool = True


def geometries(ranges: Mapping[str, Sequence[float]], draws: int) -> dict[str, dict[str, Any]]:
    """Dimensions by a name for each geometry, the one as assumed first.

    Args:
        ranges: (lowest, highest) plausible value of each dimension.
        draws: geometries in which all dimensions are drawn at once, evenly.
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


def _mini_units(dimensions: Dimensions, settings: Values, seed: int) -> list[Unit]:
    own = {key: value for key, value in dimensions.items() if key != PRESS_DEPTH}
    if PRESS_DEPTH in dimensions:
        settings = {**settings, "depth": dimensions[PRESS_DEPTH]}
    designs = [
        sensor("gelsight-mini-cylindrical", {"coating.specularity": float(value)}, **own)
        for value in (LOW, HIGH)
    ]
    return [_score(design, settings, seed) for design in designs]


def _mini_margins(records: Sequence[Record], settings: Values) -> dict[str, float | None]:
    low, high = records
    return {f"mini {name}": _difference(low, high, name) for name in OBJECTIVES}


def _belt_units(dimensions: Dimensions, settings: Values, seed: int) -> list[Unit]:
    belt = {**settings, "resolution": settings["belt_resolution"]}
    designs = [sensor("gelbelt", light_design=number, **dimensions) for number in (3, 2, 1)]
    light = [
        Unit(
            picture,
            {
                "design": design,
                "contacts": NINE,
                "resolution": [120, 90],
                "photons": settings["photons"],
                "seed": seed,
            },
            "light",
        )
        for design in (designs[0], designs[2])
    ]
    return [*(_score(design, belt, seed) for design in designs[:2]), *light]


def _belt_margins(records: Sequence[Record], settings: Values) -> dict[str, float | None]:
    third, second, bright, dark = records
    found = {f"belt {name}": _difference(third, second, name) for name in OBJECTIVES}
    lit = [record.values.get("radiance") for record in (bright, dark)]
    found["belt light"] = (
        None if lit[0] is None or lit[1] is None else gelbelt_lights.DARK - lit[1] / lit[0]
    )
    return found


def _colour_units(dimensions: Dimensions, settings: Values, seed: int) -> list[Unit]:
    return [
        Unit(
            relit_scores,
            {
                "design": sensor("gelsight360", **dimensions),
                "groups": gelsight360.GROUPS,
                "colourings": list(gelsight360_claims.PAPER),
                "objectives": ["normdiff"],
                "settings": {
                    "resolution": settings["fingertip_resolution"],
                    "photons": settings["photons"],
                    "seed": seed,
                },
                "own": {"least_pixels": settings["least_pixels"]},
            },
            "colourings",
        )
    ]


def _colour_margins(records: Sequence[Record], settings: Values) -> dict[str, float | None]:
    found = records[0].values.get("colourings", {})

    def score(letters: str) -> float | None:
        value = found.get(letters, {}).get("scores", {}).get("normdiff")
        return None if value is None else float(value)

    first, other = score("RGBRGBRG"), score("GRRGGRRG")
    return {"colours": None if first is None or other is None else first - other}


def _tip_units(dimensions: Dimensions, settings: Values, seed: int) -> list[Unit]:
    return [
        Unit(
            scores,
            {
                "design": sensor("gelsight360", tip_design=float(tip), **dimensions),
                "objectives": ["2to3pw"],
                "settings": {"ray_resolution": settings["ray_resolution"]},
            },
            f"tip {tip}",
        )
        for tip in settings["tips"]
    ]


def _tip_margins(records: Sequence[Record], settings: Values) -> dict[str, float | None]:
    near: list[float] = []
    far: list[float] = []
    for tip, record in zip(settings["tips"], records, strict=True):
        value = record.values.get("scores", {}).get("2to3pw")
        if value is not None:
            (near if abs(tip - gelsight360_claims.PAPERS_TIP) <= 1 else far).append(float(value))
    return {"tip": max(near) - max(far) if near and far else None}


def _mirror_units(dimensions: Dimensions, settings: Values, seed: int) -> list[Unit]:
    return [
        svelte_mirror.search_unit(
            "gradient",
            settings["mirror_trials"],
            0,
            settings["mirror_resolution"],
            sensor("gelsight-svelte", **dimensions),
        )
    ]


def _mirror_margins(records: Sequence[Record], settings: Values) -> dict[str, float | None]:
    values = records[0].values
    if "best" not in values:
        return {"mirror": None}
    return {"mirror": values["best"]["aoap"] - TIMES * values["start"]["aoap"]}


QUESTIONS = (
    Question(
        "gelsight-mini-cylindrical",
        {
            f"mini {name}": f"On the cylindrical Mini a specularity of {LOW} is better than {HIGH} "
            f"by {title}."
            for name, title in OBJECTIVES.items()
        },
        _mini_units,
        _mini_margins,
    ),
    Question(
        "gelbelt",
        {
            **{
                f"belt {name}": f"GelBelt's light design 3 is better than 2 by {title}."
                for name, title in OBJECTIVES.items()
            },
            "belt light": "GelBelt's light design 1 brings less than "
            f"{100 * gelbelt_lights.DARK:g} % of design 3's light to the belt.",
        },
        _belt_units,
        _belt_margins,
    ),
    Question(
        "gelsight360",
        {"colours": "GelSight360's colouring RGBRGBRG is better than the original by NormDiff."},
        _colour_units,
        _colour_margins,
    ),
    Question(
        "gelsight360",
        {"tip": "GelSight360's tip with the best 2to3PW is 6, or next to it."},
        _tip_units,
        _tip_margins,
        has_chance=False,
    ),
    Question(
        "gelsight-svelte",
        {"mirror": f"Bending GelSight Svelte's mirror makes AOAP {TIMES:g} times as large."},
        _mirror_units,
        _mirror_margins,
        has_chance=False,
    ),
)
CONCLUSIONS = {name: text for question in QUESTIONS for name, text in question.conclusions.items()}


def steps(settings: Values) -> Steps:
    """All questions of all geometries; the geometry as assumed with all seeds."""
    asked: list[tuple[Question, str, list[Unit]]] = []
    for question in QUESTIONS:
        ranges = settings["ranges"][question.sensor]
        for name, dimensions in geometries(ranges, settings["draws"]).items():
            count = settings["seeds"] if name == AS_ASSUMED and question.has_chance else 1
            for seed in range(count):
                units = question.units(dimensions, settings, seed)
                told = [
                    Unit(u.work, u.inputs, f"{question.sensor}, {name}: {u.label}") for u in units
                ]
                asked.append((question, name, told))
    records = iter((yield [unit for _, _, units in asked for unit in units]))
    margins: dict[str, dict[str, list[float | None]]] = {name: {} for name in CONCLUSIONS}
    for question, geometry, units in asked:
        found = question.margins([next(records) for _ in units], settings)
        for name in question.conclusions:
            margins[name].setdefault(geometry, []).append(found[name])
    return Finding({"margins": {name: _told(rows) for name, rows in margins.items()}})


def _told(rows: Mapping[str, list[float | None]]) -> Values:
    """The margin as assumed with its noise, and margin and verdict of each geometry."""
    nominal = spread(rows[AS_ASSUMED])
    noise = nominal["standard_deviation"] or 0.0
    verdicts: dict[str, Any] = {}
    for geometry, values in rows.items():
        value = nominal["mean"] if geometry == AS_ASSUMED else values[0]
        sure = value is not None and abs(value) > noise
        holds = bool(value is not None and value > 0.0) if sure else None
        verdicts[geometry] = {"margin": value, "holds": holds}
    return {"as_assumed": nominal, "geometries": verdicts}


def claims(numbers: Values) -> list[Claim]:
    """One a conclusion: it agrees where it holds in all geometries."""
    return [_claim(CONCLUSIONS[name], found) for name, found in numbers["margins"].items()]


def _claim(text: str, found: Values) -> Claim:
    verdicts = {name: each["holds"] for name, each in found["geometries"].items()}
    holding = [name for name, holds in verdicts.items() if holds]
    failing = [name for name, holds in verdicts.items() if holds is False]
    unsure = [name for name, holds in verdicts.items() if holds is None]
    here = f"holds in {len(holding)} of {len(verdicts)} geometries"
    if failing:
        here += f"; not with {', '.join(failing)}" if holding else ""
    if unsure:
        here += f"; within the noise or without a score: {', '.join(unsure)}"
    told = True if holding and not failing and not unsure else None
    if failing and not holding:
        told = False
    why = (
        "No change of the assumed dimensions within their plausible range brings it about, so "
        "something else than these explains the difference."
        if told is False
        else "It hangs on dimensions that are assumed here."
        if failing
        else "In some geometries the margin is no larger than its noise."
    )
    return Claim(text, here, told, why)


def notes(numbers: Values) -> list[str]:
    """What a geometry is."""
    return [
        "A geometry is the sensor with one assumed dimension at an end of its plausible range, or "
        "with all of them drawn. A statement agrees here if it holds in all of them, and disagrees "
        "if it holds in none. The noise of a margin is its standard deviation over the seeds of "
        "the sensor as assumed."
    ]


def tables(numbers: Values) -> list[Table]:
    """The margins of each sensor's conclusions."""
    found = []
    for question in QUESTIONS:
        names = list(question.conclusions)
        columns = [numbers["margins"][name] for name in names]
        rows = [
            [geometry, *(_cell(column["geometries"][geometry]) for column in columns)]
            for geometry in columns[0]["geometries"]
        ]
        noise = [number(c["as_assumed"]["standard_deviation"] or 0.0, 2) for c in columns]
        rows.append(["noise", *noise])
        found.append(Table(f"Margins, {question.sensor}", ["geometry", *names], rows))
    return found


def _cell(each: Values) -> str:
    mark = {True: "holds", False: "does not", None: "?"}[each["holds"]]
    return "no score" if each["margin"] is None else f"{each['margin']:+.3g} ({mark})"


def draw(numbers: Values, pictures: Pictures) -> Figure:
    """Each margin over what it could be: in units of the largest of its conclusion."""
    from optisense.report.drawing import AMBER, BLUE, GREY, RED, new_figure

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


def _score(design: Values, settings: Values, seed: int) -> Unit:
    return Unit(
        scores,
        {
            "design": design,
            "objectives": list(OBJECTIVES),
            "settings": {
                "resolution": settings["resolution"],
                "photons": settings["photons"],
                "seed": seed,
                **({"depth": settings["depth"]} if "depth" in settings else {}),
            },
        },
        f"seed {seed}",
    )


def _difference(one: Record, other: Record, name: str) -> float | None:
    values = [record.values.get("scores", {}).get(name) for record in (one, other)]
    return None if None in values else float(values[0]) - float(values[1])


EXPERIMENT = Experiment(
    name="robustness",
    title="Robustness of the conclusions",
    about="which conclusions survive a change of the assumed dimensions, and which do not",
    steps=steps,
    claims=claims,
    tables=tables,
    draw=draw,
    notes=notes,
)
