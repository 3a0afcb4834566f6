"""Evaluations of each geometry of a sensor, and the margins of the paper's conclusions there."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from paper import gelbelt_lights, gelsight360, gelsight360_claims, svelte_mirror
from paper.evaluations import NINE, picture, relit_scores, score_unit, sensor
from paper.experiment import Values
from paper.mini_shapes import OBJECTIVES
from paper.unit import Record, Unit

LOW, HIGH = "0.2", "0.6"
"""Specularities (0 to 1) of the Mini's coating that are compared, as keys of results."""

PRESS_DEPTH = "press_depth"
"""Name, among the ranges of dimensions, of the depth (mm) to which the objectives press balls.

It is no dimension of the sensor, but the paper does not state it either.
"""

FOUND, ORIGINAL = "RGBRGBRG", "GRRGGRRG"
"""Colourings of GelSight360: the paper's best by NormDiff, and that of the original sensor."""

LEAST_GAIN = 2.0
"""Factor by which the search must raise AOAP for the conclusion to hold; it is 2.7 in the paper."""

Dimensions = Mapping[str, Any]
"""Arguments of a sensor's builder by name."""


@dataclass(frozen=True)
class Question:
    """Evaluations of one geometry of a sensor, and the margins that follow from them.

    Attributes:
        title: what the question is about, for readers.
        sensor: name of a built-in sensor.
        conclusions: conclusions of the paper by short names.
        units: returns the units from dimensions, settings and a seed.
        margins: returns the margins by the conclusions' names, from the records of these units.
        has_chance: whether the results depend on the seed.
    """

    title: str
    sensor: str
    conclusions: Mapping[str, str]
    units: Callable[[Dimensions, Values, int], list[Unit]]
    margins: Callable[[Sequence[Record], Values], dict[str, float | None]]
    has_chance: bool = True


def _mini_units(dimensions: Dimensions, settings: Values, seed: int) -> list[Unit]:
    own = {key: value for key, value in dimensions.items() if key != PRESS_DEPTH}
    if PRESS_DEPTH in dimensions:
        settings = {**settings, "depth": dimensions[PRESS_DEPTH]}
    settings = {**settings, "photons": settings["mini_photons"]}
    return [
        _score(
            sensor("gelsight-mini-ideal-cylindrical", {"coating.specularity": float(value)}, **own),
            settings,
            seed,
            f"specularity {value}",
        )
        for value in (LOW, HIGH)
    ]


def _mini_margins(records: Sequence[Record], settings: Values) -> dict[str, float | None]:
    low, high = records
    return {f"mini {name}": _difference(low, high, name) for name in OBJECTIVES}


def _belt_units(dimensions: Dimensions, settings: Values, seed: int) -> list[Unit]:
    belt = {**settings, "resolution": settings["belt_resolution"]}
    designs = {number: sensor("gelbelt", light_design=number, **dimensions) for number in (3, 2, 1)}
    light = [
        Unit(
            picture,
            {
                "design": designs[number],
                "contacts": NINE,
                "resolution": [120, 90],
                "photons": settings["photons"],
                "seed": seed,
            },
            f"light of design {number}",
        )
        for number in (3, 1)
    ]
    scored = [_score(designs[n], belt, seed, f"light design {n}") for n in (3, 2)]
    return [*scored, *light]


def _belt_margins(records: Sequence[Record], settings: Values) -> dict[str, float | None]:
    third, second, bright, dark = records
    found = {f"belt {name}": _difference(third, second, name) for name in OBJECTIVES}
    lit, unlit = (record.values.get("radiance") for record in (bright, dark))
    share = None if lit is None or unlit is None else unlit / lit
    found["belt light"] = None if share is None else gelbelt_lights.DARK - share
    return found


def _colour_units(dimensions: Dimensions, settings: Values, seed: int) -> list[Unit]:
    return [
        Unit(
            relit_scores,
            {
                "design": sensor("gelsight360", **dimensions),
                "groups": gelsight360.GROUPS,
                "colourings": [FOUND, ORIGINAL],
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
    first, other = (
        found.get(letters, {}).get("scores", {}).get("normdiff") for letters in (FOUND, ORIGINAL)
    )
    return {"colours": None if first is None or other is None else first - other}


def _tip_units(dimensions: Dimensions, settings: Values, seed: int) -> list[Unit]:
    return [
        score_unit(
            sensor("gelsight360", tip_design=float(tip), **dimensions),
            ["2to3pw"],
            {"ray_resolution": gelsight360.ray_grid(settings, seed)},
            f"tip {tip}",
        )
        for tip in settings["tips"]
    ]


def _tip_margins(records: Sequence[Record], settings: Values) -> dict[str, float | None]:
    near: list[float] = []
    far: list[float] = []
    for tip, record in zip(settings["tips"], records, strict=True):
        value = record.score("2to3pw")
        if value is not None:
            (near if abs(tip - gelsight360_claims.PAPERS_TIP) <= 1 else far).append(value)
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
    return {"mirror": values["best"]["aoap"] - LEAST_GAIN * values["start"]["aoap"]}


def _score(design: Values, settings: Values, seed: int, what: str) -> Unit:
    images: Values = {
        key: settings[key] for key in ("resolution", "photons", "depth") if key in settings
    }
    return score_unit(design, OBJECTIVES, {**images, "seed": seed}, f"{what}, seed {seed}")


def _difference(one: Record, other: Record, name: str) -> float | None:
    first, second = one.score(name), other.score(name)
    return None if first is None or second is None else first - second


QUESTIONS = (
    Question(
        "coating of the cylindrical GelSight Mini",
        "gelsight-mini-ideal-cylindrical",
        {
            f"mini {name}": f"On the cylindrical Mini, a specularity of {LOW} is better than "
            f"{HIGH} by {title}."
            for name, title in OBJECTIVES.items()
        },
        _mini_units,
        _mini_margins,
    ),
    Question(
        "lights of GelBelt",
        "gelbelt",
        {
            **{
                f"belt {name}": f"GelBelt's light design 3 is better than 2 by {title}."
                for name, title in OBJECTIVES.items()
            },
            "belt light": "With GelBelt's light design 1, the belt receives less than "
            f"{100 * gelbelt_lights.DARK:g} % of the light of design 3.",
        },
        _belt_units,
        _belt_margins,
    ),
    Question(
        "colours of GelSight360",
        "gelsight360",
        {"colours": f"GelSight360's colouring {FOUND} is better than the original by NormDiff."},
        _colour_units,
        _colour_margins,
    ),
    Question(
        "tip of GelSight360",
        "gelsight360",
        {"tip": "GelSight360's tip with the best 2to3PW is 6 or a neighbour of it."},
        _tip_units,
        _tip_margins,
    ),
    Question(
        "mirror of GelSight Svelte",
        "gelsight-svelte",
        {
            "mirror": f"Bending GelSight Svelte's mirror raises AOAP to {LEAST_GAIN:g} times its "
            "value."
        },
        _mirror_units,
        _mirror_margins,
        has_chance=False,
    ),
)
CONCLUSIONS = {name: text for question in QUESTIONS for name, text in question.conclusions.items()}
