"""The paper's statements under other interpretations of its definitions.

The OptiSense paper leaves several definitions open: what specularity changes, how the camera is
exposed, how deep the balls are pressed, and details of both scores. Each combination of choices is
an interpretation, a *reading*. All of them are scored, and each statement is tested under each.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Any

from paper import gelbelt_lights, gelsight360, mini_shapes, mirror_readings
from paper.claims import Claim, Table
from paper.evaluations import relit_scores, scores_by_readings, sensor
from paper.experiment import Experiment, Finding, Pictures, Steps, Values
from paper.figures import COLOURS, finish
from paper.gelsight360_claims import LITTLE_NOISE, PAPER, colour_claims
from paper.mini_shapes import OBJECTIVES, SHAPES
from paper.spread import Spread, spread
from paper.unit import Record, Unit

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LAWS = ("blend", "blend-fixed-roughness", "conductor")
"""Models of what specularity changes (see docs/design-file.md).

In turn: the shares of paint and metal together with the metal's roughness, the shares alone, and
the roughness of bare metal.
"""

EXPOSURES = ("lowered for bright contacts", "of the untouched skin")

VARIANTS: dict[str, dict[str, dict[str, Any]]] = {
    "rgb2normal": {
        "signed tilt": {},
        "unsigned tilt": {"signed": False},
        "half lines": {"half_lines": True},
        "one dominant colour a press": {"dominant": "press"},
        "linear colours": {"colours": "response"},
    },
    "normdiff": {
        "noise to either side": {},
        "noise from end to end": {"noise": 0.15},
        "only the polar angle": {"phi_weight": 0.0},
        "colours of the picture": {"colours": "picture"},
        "one pixel for each normal": {"nearest_only": True},
    },
}
"""Readings of both scores: settings by name, the default first."""

BELT = ("2", "3")
"""Light designs of GelBelt that are compared; hardly any light of design 1 reaches the belt."""

Reading = tuple[str, ...]
"""One option of each factor, in the order of the factors."""


def factors(settings: Values) -> dict[str, tuple[str, ...]]:
    """Return the options of each factor, the default first."""
    return {
        "specularity changes": tuple(settings["laws"]),
        "exposure": EXPOSURES,
        "depth of presses": tuple(f"{depth:g} mm" for depth in settings["depths"]),
        **{OBJECTIVES[name]: tuple(own) for name, own in VARIANTS.items()},
    }


def _designs(settings: Values) -> Iterator[tuple[str, str, Values]]:
    """Yield name, law and plain design of each sensor that `scores_by_readings` scores."""
    for law in settings["laws"]:
        for value in settings["specularities"]:
            bare = law != "conductor" and value == 0.0  # without metal both blends are one
            change = {"coating.specularity": value}
            change |= {"coating.scattering": LAWS[0] if bare else law}
            for shape, name in SHAPES.items():
                yield f"{shape}, {value:g}", law, sensor(name, change)
            yield f"belt, {value:g}", law, sensor(gelbelt_lights.SENSOR, change, light_design=3)
        for design in BELT:
            change = {"coating.scattering": law}
            yield (
                f"design {design}",
                law,
                sensor(gelbelt_lights.SENSOR, change, light_design=int(design)),
            )


def steps(settings: Values) -> Steps:
    """Score all designs at all depths, with all exposures and settings of the scores."""
    images = {key: settings[key] for key in ("resolution", "photons", "together")}
    designs = list(_designs(settings))
    units = [
        Unit(
            scores_by_readings,
            {
                "design": design,
                "variants": VARIANTS,
                "exposures": list(EXPOSURES),
                "settings": {**images, "depth": depth, "seed": 0},
            },
            f"{name}, {law}, {depth:g} mm",
        )
        for depth in settings["depths"]
        for name, law, design in designs
    ]
    ways = {**VARIANTS["normdiff"], LITTLE_NOISE: {"noise": 0.03}}
    least = {"least_pixels": settings["least_pixels"]}
    coloured = [
        Unit(
            relit_scores,
            {
                "design": sensor(gelsight360.SENSOR),
                "groups": gelsight360.GROUPS,
                "colourings": list(PAPER),
                "objectives": list(OBJECTIVES),
                "settings": {
                    "resolution": settings["fingertip_resolution"],
                    "photons": settings["photons"],
                    "depth": depth,
                    "seed": 0,
                },
                "own": least,
                "normdiff_variants": {name: {**own, **least} for name, own in ways.items()},
            },
            f"GelSight360's colourings, {depth:g} mm",
        )
        for depth in settings["depths"]
    ]
    mirrors = mirror_readings.units(settings)
    records = yield [*units, *coloured, *mirrors.values()]
    keys = [(name, law, depth) for depth in settings["depths"] for name, law, _ in designs]
    answers = dict(zip(keys, records, strict=False))
    tips = dict(zip(settings["depths"], records[len(units) : -len(mirrors)], strict=True))
    options = factors(settings)
    pressed = (
        _claims_under(reading, settings, answers, tips)
        for reading in itertools.product(*options.values())
    )
    mirror = (
        [_named("GelSight Svelte", each) for each in mirror_readings.claims_of(record)]
        for record in records[-len(mirrors) :]
    )
    return Finding({**_held(options, pressed), "mirror": _held(mirror_readings.factors(), mirror)})


def _held(options: dict[str, tuple[str, ...]], found: Iterable[list[Claim]]) -> Values:
    """Return the factors, and whether each statement holds, in the order of the readings."""
    held: dict[str, list[bool | None]] = {}
    for claims_found in found:
        for claim in claims_found:
            held.setdefault(claim.says, []).append(claim.holds)
    return {"factors": {name: list(each) for name, each in options.items()}, "held": held}


def _groups(numbers: Values) -> list[Values]:
    """Return the statements on pressed balls and those on the mirror, each with their factors."""
    return [{key: numbers[key] for key in ("factors", "held")}, numbers["mirror"]]


def _claims_under(
    reading: Reading,
    settings: Values,
    answers: dict[tuple[str, str, float], Record],
    tips: dict[float, Record],
) -> list[Claim]:
    """Return the paper's statements, with verdicts from the scores of one reading."""
    law, exposure, depth_text, *own = reading
    depth = next(each for each in settings["depths"] if f"{each:g} mm" == depth_text)
    variant = dict(zip(VARIANTS, own, strict=True))

    def column(labels: dict[str, str], objective: str) -> dict[str, Spread]:
        found = {}
        for name, label in labels.items():
            rows = answers[label, law, depth].values.get("scores", {})
            row = rows.get(exposure, {}).get(objective, {})
            found[name] = spread([row.get(variant[objective])])
        return found

    values = [f"{value:g}" for value in settings["specularities"]]
    mini = {
        shape: {
            name: column({value: f"{shape}, {value}" for value in values}, name)
            for name in OBJECTIVES
        }
        for shape in SHAPES
    }
    found = [_named("GelSight Mini", each) for each in mini_shapes.claims({"scores": mini})]
    for name, title in OBJECTIVES.items():
        designs = column({each: f"design {each}" for each in BELT}, name)
        coatings = column({value: f"belt, {value}" for value in values}, name)
        found.append(_named("GelBelt", gelbelt_lights.third_is_best(designs, title)))
        found.append(_named("GelBelt", gelbelt_lights.coating_is_dull(coatings, title)))
    colours = {}
    for letters in PAPER:
        row = tips[depth].values.get("colourings", {}).get(letters, {})
        ways = {way: spread([value]) for way, value in row.get("normdiff_variants", {}).items()}
        nothing = spread([None])
        colours[letters] = {
            "rgb2normal": spread([row.get("scores", {}).get("rgb2normal")]),
            "normdiff": ways.get(variant["normdiff"], nothing),
            "ways": {LITTLE_NOISE: ways.get(LITTLE_NOISE, nothing)},
        }
    return [*found, *(_named("GelSight360", each) for each in colour_claims(colours))]


def _named(what: str, claim: Claim) -> Claim:
    return Claim(f"{what}: {claim.says}", claim.here, claim.holds, claim.why)


def claims(numbers: Values) -> list[Claim]:
    """Return whether each statement holds under all readings, under none, or under some of them."""
    found = []
    rows = [item for group in _groups(numbers) for item in group["held"].items()]
    for says, row in rows:
        told = [holds for holds in row if holds is not None]
        count = sum(told)
        agrees = None if not told or 0 < count < len(row) else count == len(row)
        as_read = {True: "holds", False: "does not hold", None: "is inconclusive"}[row[0]]
        found.append(
            Claim(
                says,
                f"holds under {count} of {len(row)} interpretations; under the default it "
                f"{as_read}",
                agrees,
                WHY_SOME if agrees is None else WHY_NONE,
            )
        )
    return found


WHY_SOME = "The verdict depends on definitions that the paper does not give (see the table)."
WHY_NONE = (
    "The statement holds under none of these interpretations. Other interpretations, or the "
    "geometry, lights and materials of the sensor, must be the cause (see the experiment on "
    "robustness)."
)


def _readings(numbers: Values) -> list[Reading]:
    """Return all readings in the order of each statement's verdicts; the default is the first."""
    return list(itertools.product(*numbers["factors"].values()))


def tables(numbers: Values) -> list[Table]:
    """Return tables: how many statements hold with each option, and which with which options."""
    rows, best, shares = [], [], []
    for group in _groups(numbers):
        held = group["held"]
        counts = _counts(held)
        names = list(group["factors"])
        reading = _readings(group)[counts.index(max(counts))]
        said = ", ".join(f"{name}: {each}" for name, each in zip(names, reading, strict=True))
        best.append([f"{max(counts)} of {len(held)}", said])
        own, cells = _by_option(group)
        rows += own
        shares.append(
            Table(
                "Share of interpretations under which each statement holds, %, by the options in "
                "the order of the first table",
                ["statement", *names],
                [[says, *cell] for says, cell in zip(held, cells, strict=True)],
            )
        )
    return [
        Table(
            "Statements that hold with one option changed from the default, and the share of "
            "statements that hold over all interpretations with this option",
            ["factor", "option", "changed alone", "over all interpretations"],
            rows,
        ),
        Table(
            "The interpretations under which most statements on pressed balls and on the mirror "
            "hold",
            ["statements", "interpretation"],
            best,
        ),
        *shares,
    ]


def _by_option(group: Values) -> tuple[list[list[str]], list[list[str]]]:
    """Return a row for each option of each factor, and for each statement a cell per factor."""
    held, readings = group["held"], _readings(group)
    rows: list[list[str]] = []
    cells: list[list[str]] = [[] for _ in held]
    for place, (factor, options) in enumerate(group["factors"].items()):
        shown: list[list[str]] = [[] for _ in held]
        for option in options:
            alone = readings.index((*readings[0][:place], option, *readings[0][place + 1 :]))
            among = [k for k, reading in enumerate(readings) if reading[place] == option]
            parts = [sum(row[k] is True for k in among) / len(among) for row in held.values()]
            count = sum(row[alone] is True for row in held.values())
            mean = sum(parts) / max(1, len(parts))
            rows.append([factor, option, f"{count} of {len(held)}", f"{100 * mean:.0f} %"])
            for cell, part in zip(shown, parts, strict=True):
                cell.append(f"{100 * part:.0f}")
        for line, cell in zip(cells, shown, strict=True):
            line.append(" / ".join(cell))
    return rows, cells


def _counts(held: dict[str, list[bool | None]]) -> list[int]:
    """Return the number of statements that hold, for each reading."""
    return [
        sum(holds is True for holds in verdicts) for verdicts in zip(*held.values(), strict=True)
    ]


def notes(numbers: Values) -> list[str]:
    """Return paragraphs on what is varied, and for which sensors."""
    return [
        "Each combination of the options is one interpretation. In this section, *inconclusive* "
        "means that a statement holds under some interpretations and not under others. The effect "
        "of the specularity, the exposure and the definition of RGB2Normal are varied for GelSight "
        "Mini and GelBelt. For GelSight360's colourings, which are computed from layers, the depth "
        "and the definition of NormDiff are varied. For GelSight Svelte, whose mirror is optimised "
        "by the gradient method, the bounds of the mirror and the part of the skin are varied. The "
        "defaults follow the paper's text and not this table. With few specularities, a statement "
        "on the best one may hold by chance: a quick run has three, and bends the mirror in 10 "
        "trials instead of 40."
    ]


def draw(numbers: Values, pictures: Pictures) -> Figure:
    """Draw the number of readings over the number of statements that hold under them."""
    from optisense.figures import new_figure

    figure = new_figure(7.0, 3.2)
    axes = figure.add_subplot()
    counts = _counts(numbers["held"])
    most = len(numbers["held"])
    axes.bar(range(most + 1), [counts.count(k) for k in range(most + 1)], color=COLOURS[0])
    axes.axvline(counts[0], color=COLOURS[1], linestyle="--", label="default")
    finish(
        axes,
        "Interpretations by number of statements that hold",
        f"statements of {most}",
        legend=True,
    )
    return figure


EXPERIMENT = Experiment(
    name="readings",
    title="Other interpretations of the paper's definitions",
    about="what holds under other definitions of specularity, exposure, depth and both scores",
    steps=steps,
    claims=claims,
    tables=tables,
    draw=draw,
    notes=notes,
    repeats_claims=True,
)
