"""Experiment on flat, cylindrical and spherical GelSight Minis: which coating scores best.

It reproduces case study I of the OptiSense paper and its figure: RGB2Normal and NormDiff of nine
balls of 1.5 mm over the specularity of the coating.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from paper.claims import Claim, Table
from paper.evaluations import NINE, picture, score_unit, sensor
from paper.experiment import Experiment, Finding, Pictures, Steps, Values
from paper.figures import COLOURS, finish, image, line
from paper.spread import (
    Spread,
    best,
    best_satisfies,
    is_larger,
    number,
    shown,
    spread,
    spread_of,
)
from paper.unit import Unit

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SHAPES = {
    "flat": "gelsight-mini-ideal",
    "cylinder": "gelsight-mini-ideal-cylindrical",
    "sphere": "gelsight-mini-ideal-spherical",
}
OBJECTIVES = {"rgb2normal": "RGB2Normal", "normdiff": "NormDiff"}

CYLINDER_BEST = 0.2
"""Specularity (0 to 1) near which the paper finds the cylinder best."""
SPHERE_MOST = 0.4
"""Specularity (0 to 1) up to which the paper finds the sphere best."""

SIMILAR = {"rgb2normal": 0.05, "normdiff": 0.1}
"""Largest relative loss of a score, compared with the flat sensor, at which a performance counts as
similar; the paper shows it in a figure without numbers."""


def score_units(settings: Values, sensors: dict[str, str]) -> list[Unit]:
    """Return the units of scores of sensors at all specularities with all seeds."""
    return [
        score_unit(
            sensor(name, {"coating.specularity": value}),
            OBJECTIVES,
            {**{key: settings[key] for key in ("resolution", "photons")}, "seed": seed},
            f"{label}, specularity {value:g}, seed {seed}",
        )
        for label, name in sensors.items()
        for value in settings["specularities"]
        for seed in range(settings["seeds"])
    ]


def curves(settings: Values, records: list[Any], sensors: dict[str, str]) -> Values:
    """Return scores over seeds by sensor, objective and specularity, and the best specularities."""
    answers = iter(records)
    found: Values = {}
    for label in sensors:
        columns: Values = {name: {} for name in OBJECTIVES}
        for value in settings["specularities"]:
            rows = [next(answers) for _ in range(settings["seeds"])]
            for name in OBJECTIVES:
                columns[name][f"{value:g}"] = spread_of(name, rows)
        found[label] = columns
    return found


def steps(settings: Values) -> Steps:
    """Compute the scores, and a picture of each shape with its own coating."""
    pictures = [
        Unit(
            picture,
            {
                "design": sensor(name, {"coating.specularity": CYLINDER_BEST * (label != "flat")}),
                "contacts": NINE,
                "depth": 0.3,
                "resolution": settings["resolution"],
                "photons": settings["photons"],
                "seed": 0,
            },
            f"{label}, picture",
        )
        for label, name in SHAPES.items()
    ]
    units = score_units(settings, SHAPES)
    records = yield [*units, *pictures]
    seen = {
        label: each.pictures()["picture"]
        for label, each in zip(SHAPES, records[len(units) :], strict=True)
        if each.pictures()
    }
    return Finding({"scores": curves(settings, records[: len(units)], SHAPES)}, seen)


def claims(numbers: Values) -> list[Claim]:
    """Return the paper's statements on the best coating of each shape, with verdicts."""
    found = []
    for name, title in OBJECTIVES.items():
        found += [
            best_claim(
                f"On the cylinder, a specularity of about {CYLINDER_BEST:g} is best ({title}).",
                numbers["scores"]["cylinder"][name],
                lambda value: float(value) == CYLINDER_BEST,
                WHY_COATING,
            ),
            best_claim(
                f"On the sphere, a specularity of up to {SPHERE_MOST:g} is best ({title}).",
                numbers["scores"]["sphere"][name],
                lambda value: float(value) <= SPHERE_MOST,
                WHY_COATING,
            ),
        ]
    for label in ("cylinder", "sphere"):
        found.append(_similar(numbers["scores"], label))
    return found


def _similar(all_scores: Values, label: str) -> Claim:
    verdicts: set[bool | None] = set()
    texts = []
    for name, title in OBJECTIVES.items():
        flat, bent = (_of_best(all_scores[shape][name]) for shape in ("flat", label))
        if flat is None or bent is None:
            continue
        least = [None if v is None else v - SIMILAR[name] * abs(v) for v in flat["values"]]
        verdicts.add(is_larger(bent, spread(least)))
        texts.append(f"{title} {number(bent['mean'])}, flat sensor {number(flat['mean'])}")
    return Claim(
        f"With the best coating, the {label} is about as good as the flat sensor.",
        ", ".join(texts) or "no scores",
        False if False in verdicts else True if verdicts == {True} else None,
        WHY_FLAT,
    )


def _of_best(column: Values) -> Spread | None:
    top, _ = best(column)
    return None if top is None else column[top]


def best_claim(says: str, column: Values, holds_for: Callable[[str], bool], why: str) -> Claim:
    """Return a statement on the best of several variants, with its verdict from their scores."""
    top, alike = best(column)
    here = "no scores"
    if top is not None:
        others = ", ".join(value for value in alike if value != top)
        more = f"; not significantly different: {others}" if others else ""
        here = f"best at {top} ({shown(column[top])}){more}"
    return Claim(says, here, best_satisfies(alike, holds_for), why)


WHY_COATING = (
    "A metallic coating reflects light away from its source and thereby makes the illumination of "
    "a curved gel more even. The specularity at which this effect is best depends on the height at "
    "which the light enters. The paper gives neither the light guide, the positions of the LEDs, "
    "the depth of the presses, nor the roughness of the metal at a given specularity. Those of the "
    "models are assumed (see the provenance of the sensor, and the experiment on robustness)."
)
WHY_FLAT = (
    "Where the gel is curved, the light from the sides of the guide reaches only one flank of a "
    "ball, and the other flank is in shadow: colours there do not depend on the tilt. The paper "
    "shows the similarity in a figure without numbers. Here, scores are similar if they differ by "
    f"at most {100 * SIMILAR['rgb2normal']:g} % (RGB2Normal) and {100 * SIMILAR['normdiff']:g} % "
    "(NormDiff)."
)


FITTED_NOTE = (
    "With the light and camera of a real unit (the built-in `gelsight-mini` and its cylindrical "
    "and spherical forms), three of the six verdicts change; [the page on "
    "calibration](calibration.md#a-real-gelsight-mini) has the scores."
)


def tables(numbers: Values) -> list[Table]:
    """Return one table for each objective."""
    found = []
    for name, title in OBJECTIVES.items():
        columns = [numbers["scores"][label][name] for label in SHAPES]
        rows = [[value, *(shown(column[value]) for column in columns)] for value in columns[0]]
        found.append(Table(title, ["specularity", *SHAPES], rows))
    return found


def draw(numbers: Values, pictures: Pictures) -> Figure:
    """Draw both objectives over specularity, and nine balls on each shape."""
    from optisense.figures import new_figure

    figure = new_figure(11.0, 6.4)
    grid = figure.add_gridspec(2, 6)
    for place, (name, title) in enumerate(OBJECTIVES.items()):
        axes = figure.add_subplot(grid[0, 3 * place : 3 * place + 3])
        for colour, label in zip(COLOURS, SHAPES, strict=False):
            line(axes, numbers["scores"][label][name], label, colour)
        finish(axes, f"{title} (higher is better)", "specularity of the coating", legend=True)
    for place, label in enumerate(SHAPES):
        axes = figure.add_subplot(grid[1, 2 * place : 2 * place + 2])
        coat = 0.0 if label == "flat" else CYLINDER_BEST
        image(axes, pictures.get(label), f"{label}, specularity {coat:g}: nine balls")
    return figure


EXPERIMENT = Experiment(
    name="mini-shapes",
    title="GelSight Mini: shapes and coatings",
    about="flat, cylindrical and spherical Mini: specularity against RGB2Normal and NormDiff",
    steps=steps,
    claims=claims,
    tables=tables,
    draw=draw,
    notes=lambda numbers: [FITTED_NOTE],
)
