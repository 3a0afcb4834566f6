"""Experiment on GelBelt: positions of the lights, coating, and pictures of objects.

It reproduces case study II of the OptiSense paper: light designs 1 to 3 by forward design, the
coating by a search, and pictures of a screw, a breadboard and a rack.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from paper.claims import Claim, Table
from paper.evaluations import NINE, picture, score_unit, sensor
from paper.experiment import Experiment, Finding, Pictures, Steps, Values
from paper.figures import COLOURS, finish, image, line
from paper.mini_shapes import OBJECTIVES, best_claim
from paper.spread import best, best_satisfies, number, shown, spread, spread_of
from paper.unit import Unit

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SENSOR = "gelbelt"
DESIGNS = ("1", "2", "3")
MOST_SPECULAR = 0.3
"""Specularity (0 to 1) below which the paper finds the best coating."""

DARK = 0.1
"""Share of the best light design's light on the belt below which a light design counts as
failed."""


def steps(settings: Values) -> Steps:
    """Score light designs and coatings of the third one, and render pictures."""
    seeds = range(settings["seeds"])
    images = {key: settings[key] for key in ("resolution", "photons")}
    asked = {
        **{
            f"light design {design}, seed {seed}": (int(design), {}, seed)
            for design in DESIGNS
            for seed in seeds
        },
        **{
            f"specularity {value:g}, seed {seed}": (3, {"coating.specularity": value}, seed)
            for value in settings["specularities"]
            for seed in seeds
        },
    }
    scored = [
        score_unit(
            sensor(SENSOR, change, light_design=design), OBJECTIVES, {**images, "seed": seed}, label
        )
        for label, (design, change, seed) in asked.items()
    ]
    contacts = {f"light design {design}": (int(design), NINE) for design in DESIGNS}
    contacts |= {name: (3, [text]) for name, text in settings["objects"].items()}
    seen = [
        Unit(
            picture,
            {"design": sensor(SENSOR, light_design=d), "contacts": c, "seed": seed, **images},
            f"picture: {name}, seed {seed}",
        )
        for name, (d, c) in contacts.items()
        for seed in (seeds if c == NINE else [0])
    ]
    records = yield [*scored, *seen]
    answers = iter(records)
    by_design: Values = {}
    for design in DESIGNS:
        rows = [next(answers) for _ in seeds]
        by_design[design] = {name: spread_of(name, rows) for name in OBJECTIVES}
    by_coating: Values = {name: {} for name in OBJECTIVES}
    for value in settings["specularities"]:
        rows = [next(answers) for _ in seeds]
        for name in OBJECTIVES:
            by_coating[name][f"{value:g}"] = spread_of(name, rows)
    pictures: Pictures = {}
    for name, (_, where) in contacts.items():
        rows = [next(answers) for _ in (seeds if where == NINE else [0])]
        if rows[0].pictures_file is not None:
            pictures[name] = rows[0].pictures()["picture"]
        if where == NINE:
            light = spread([row.values.get("radiance") for row in rows])
            by_design[name.removeprefix("light design ")]["light"] = light
    return Finding({"designs": by_design, "coatings": by_coating}, pictures)


def claims(numbers: Values) -> list[Claim]:
    """Return the paper's statements on the lights and the coating, with verdicts."""
    designs = numbers["designs"]
    light = {name: designs[name]["light"]["mean"] or 0.0 for name in DESIGNS}
    share = light["1"] / max(light.values()) if max(light.values()) > 0 else None
    found = [
        Claim(
            "Light from the sides of the acrylic (design 1) hardly reaches the belt.",
            "the part of the belt that the camera sees receives "
            f"{number(100 * share if share is not None else None, 2)} % of the light of the "
            "brightest design",
            None if share is None else share < DARK,
            "The film of air between tape and acrylic is decisive: without it, the light reaches "
            "the belt.",
        )
    ]
    for name, title in OBJECTIVES.items():
        found.append(third_is_best({each: designs[each][name] for each in DESIGNS}, title))
    for name, title in OBJECTIVES.items():
        found.append(coating_is_dull(numbers["coatings"][name], title))
    return found


def coating_is_dull(column: Values, title: str) -> Claim:
    """Return the paper's statement on the best coating, with its verdict from scores."""
    return best_claim(
        f"A specularity below {MOST_SPECULAR:g} is best ({title}).",
        column,
        lambda value: float(value) < MOST_SPECULAR,
        WHY_COATING,
    )


def third_is_best(column: Values, title: str) -> Claim:
    """Return the paper's statement on the third light design, with its verdict from scores."""
    texts = [f"design {name}: {shown(each)}" for name, each in column.items()]
    return Claim(
        f"Design 3, with the belt bent over a small roller, is the best ({title}).",
        ", ".join(texts),
        best_satisfies(best(column)[1], lambda design: design == "3"),
        WHY_THIRD,
    )


WHY_THIRD = (
    "Both designs have the same red and blue light from the sides of the belt, and differ in the "
    "range of the green light. A score of pressed balls depends only in part on green, and where "
    "green overlaps with the other two colours, more of it can also lower the score. The paper "
    "also judges the third design by images. In the model, the roller, its angle and the positions "
    "of the LEDs are assumed."
)
WHY_COATING = (
    "A metallic coating reflects light from the lit edges of the belt onwards to its middle, "
    "whereas a diffuse grey coating would not. The sizes of the window, of the belt and of "
    "the rows of LEDs are assumed, and the paper shows only normalised scores."
)


def tables(numbers: Values) -> list[Table]:
    """Return the tables of light designs and of coatings."""
    designs, coatings = numbers["designs"], numbers["coatings"]
    lights = [
        [name, *(shown(designs[name][key]) for key in (*OBJECTIVES, "light"))] for name in DESIGNS
    ]
    values = [
        [value, *(shown(coatings[name][value]) for name in OBJECTIVES)]
        for value in coatings["rgb2normal"]
    ]
    return [
        Table(
            "Light designs (light: mean radiance before exposure)",
            ["design", *OBJECTIVES.values(), "light"],
            lights,
        ),
        Table("Coatings of design 3", ["specularity", *OBJECTIVES.values()], values),
    ]


def draw(numbers: Values, pictures: Pictures) -> Figure:
    """Draw pictures of the designs and of the objects, and scores over specularity."""
    from optisense.figures import new_figure

    figure = new_figure(11.0, 8.4)
    grid = figure.add_gridspec(3, 6)
    for row, names in enumerate(
        ([f"light design {d}" for d in DESIGNS], [n for n in pictures if "design" not in n])
    ):
        for column, name in enumerate(names[:3]):
            axes = figure.add_subplot(grid[row, 2 * column : 2 * column + 2])
            image(axes, pictures.get(name), name)
    for place, (name, title) in enumerate(OBJECTIVES.items()):
        axes = figure.add_subplot(grid[2, 3 * place : 3 * place + 3])
        line(axes, numbers["coatings"][name], "", COLOURS[place])
        finish(axes, f"{title}, light design 3", "specularity of the coating")
    return figure


EXPERIMENT = Experiment(
    name="gelbelt-lights",
    title="GelBelt: lights and coating",
    about="light designs 1, 2 and 3, then the coating, then a screw, a breadboard and a rack",
    steps=steps,
    claims=claims,
    tables=tables,
    draw=draw,
)
