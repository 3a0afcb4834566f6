"""Experiment on GelSight360: colours of its lights, shape of its tip, shape of its resin.

It reproduces case study III of the OptiSense paper: the table of five colourings by NormDiff and
RGB2Normal, tips 0 (flat) to 10 (conical) by 2to3PW, and resins 0 (even shell) to 10 (almost flat)
by both scores.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from optisense.objectives.normdiff import LEAST_PIXELS as LEAST_OF_NORMDIFF
from optisense.objectives.rgb2normal import LEAST_PIXELS as LEAST_OF_RGB2NORMAL
from paper.claims import Table
from paper.evaluations import relit_scores, score_unit, searched, sensor, variants_of_score
from paper.experiment import Experiment, Finding, Pictures, Steps, Values
from paper.figures import COLOURS, finish, line
from paper.gelsight360_claims import LITTLE_NOISE, PAPER, claims, papers_order
from paper.mini_shapes import OBJECTIVES
from paper.spread import number, shown, spread, spread_of
from paper.unit import Record, Unit

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SENSOR = "gelsight360"
ANY_JUMP = 1000.0
"""Largest value of the setting `jump` of 2to3PW, with which no triangle is left out."""

FINER = 6
"""Number of rows by which each grid of chief rays is finer than the one before."""

GROUPS = [f"lg{number}" for number in range(1, 9)]
"""Names of the eight light groups of GelSight360, lg1 to lg8."""


BLIND: dict[str, dict[str, Any]] = {
    "as scored": {},
    "noise of 15 % to either side": {"noise": 0.15},
    LITTLE_NOISE: {"noise": 0.03},
    "only the polar angle": {"phi_weight": 0.0},
    "only the polar angle, 15 %": {"phi_weight": 0.0, "noise": 0.15},
    "colours of the picture": {"colours": "picture"},
}
"""Settings of NormDiff by name.

The paper states neither the weights of the two angles, nor whether its noise of 30 % is to either
side or from end to end.
"""

OTHERWISE: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "as it is": ({}, {}),
    "without the ring at its foot": ({}, {"base_ring": ""}),
    "with a grey, diffuse coating": ({}, {"coating": "diffuse-grey"}),
    "with two groups lit only": (
        {f"lights.lg{k}.flux": 1e-6 for k in (2, 3, 4, 6, 7, 8)},
        {"light_colours": "RGGGGGGG", "base_ring": ""},
    ),
    "at half the resolution": ({}, {}),
    "with a tenth of the photons": ({}, {}),
}
"""Changes (values and dimensions) of the sensor or of images under which NormDiff is computed."""


def ray_grid(settings: Values, seed: int) -> list[int]:
    """Return width and height of the grid of chief rays, which differs from seed to seed.

    Scores of tips contain no random numbers; the scatter between grids takes their place.
    """
    width, height = settings["ray_resolution"]
    return [width + seed * FINER * width // height, height + seed * FINER]


def _ways(least_pixels: int) -> dict[str, dict[str, Any]]:
    return {way: {**own, "least_pixels": least_pixels} for way, own in BLIND.items()}


def _why_unit(name: str, images: Values, least_pixels: int) -> Unit:
    """Return the unit of NormDiff of one change of `OTHERWISE`, with all settings of `BLIND`."""
    change, dimensions = OTHERWISE[name]
    width, height = images["resolution"]
    if "resolution" in name:
        images = {**images, "resolution": [width // 2, height // 2]}
    if "photons" in name:
        images = {**images, "photons": images["photons"] // 10}
    return Unit(
        variants_of_score,
        {
            "design": sensor(SENSOR, change, **dimensions),
            "objective": "normdiff",
            "variants": _ways(least_pixels),
            "settings": {**images, "seed": 0},
        },
        f"NormDiff {name}",
    )


def steps(settings: Values) -> Steps:
    """Score colourings (all of them if set), tips and resins, and NormDiff with other settings."""
    seeds = range(settings["seeds"])
    images = {key: settings[key] for key in ("resolution", "photons")}
    judged = {**images, "least_pixels": settings["least_pixels"]}
    goals = list(OBJECTIVES)
    table = [
        Unit(
            relit_scores,
            {
                "design": sensor(SENSOR),
                "groups": GROUPS,
                "colourings": list(PAPER),
                "objectives": goals,
                "settings": {**images, "seed": seed},
                "own": {"least_pixels": settings["least_pixels"]},
                "normdiff_variants": _ways(settings["least_pixels"]),
            },
            f"the paper's colourings, seed {seed}",
        )
        for seed in seeds
    ]
    search = {
        "design": sensor(SENSOR),
        "space": {"lights.lg*.colour": ["R", "G", "B"]},
        "objectives": goals,
        "method": "light-colours",
        "seed": 0,
        "settings": {**judged, "photons": settings["all_photons"]},
        "all": True,
    }
    asks_all = bool(settings["all_photons"])
    everything = [Unit(searched, search, "all 6,561 colourings")] if asks_all else []
    tips = [
        score_unit(
            sensor(SENSOR, tip_design=float(tip)),
            ["2to3pw"],
            {"ray_resolution": ray_grid(settings, seed), **jump},
            f"tip {tip}, grid {seed}",
        )
        for tip in settings["tips"]
        for jump in ({}, {"jump": ANY_JUMP})
        for seed in seeds
    ]
    resins = [
        score_unit(
            sensor(SENSOR, resin_design=float(resin)),
            goals,
            {**judged, "resolution": settings["resin_resolution"], "seed": seed},
            f"resin {resin}, seed {seed}",
        )
        for resin in settings["resins"]
        for seed in seeds
    ]
    why = [_why_unit(name, images, settings["least_pixels"]) for name in settings["why"]]
    records = yield [*everything, *table, *resins, *why, *tips]
    answers = iter(records)
    overall = [next(answers) for _ in everything]
    rows = [next(answers) for _ in table]
    numbers: Values = {
        "colourings": _colourings(rows),
        "all": every_colouring(overall[0]) if overall and overall[0].failure is None else None,
        "resins": {name: {} for name in goals},
        "least_pixels": settings["least_pixels"],
    }
    for resin in settings["resins"]:
        found = [next(answers) for _ in seeds]
        for name in goals:
            numbers["resins"][name][str(resin)] = spread_of(name, found)
    numbers["why"] = {}
    for name in settings["why"]:
        values = next(answers).values
        pixels = min(values.get("pixels") or [0])
        numbers["why"][name] = {"scores": values.get("scores", {}), "pixels": pixels}
    numbers["tips"], numbers["tips_with_leaps"] = {}, {}
    for tip in settings["tips"]:
        for column in ("tips", "tips_with_leaps"):
            numbers[column][str(tip)] = spread_of("2to3pw", [next(answers) for _ in seeds])
    return Finding(numbers)


def _colourings(records: list[Record]) -> Values:
    found: Values = {}
    for letters in PAPER:
        rows = [
            record.values.get("colourings", {}).get(letters, {}).get("scores", {})
            for record in records
        ]
        found[letters] = {name: spread([row.get(name) for row in rows]) for name in OBJECTIVES}
        variants = [
            record.values.get("colourings", {}).get(letters, {}).get("normdiff_variants", {})
            for record in records
        ]
        found[letters]["ways"] = {way: spread([row.get(way) for row in variants]) for way in BLIND}
    return found


def every_colouring(record: Record) -> Values:
    """Return the best of all colourings by each objective, and the position of the others."""
    shares = {"1,0,0": "R", "0,1,0": "G", "0,0,1": "B"}
    trials = [
        ("".join(shares.get(str(v), str(v)[0].upper()) for v in values), own)
        for values, own in record.values["trials"]
    ]
    found: Values = {"colourings": len(trials)}
    for name in OBJECTIVES:
        there = [(own[name], letters) for letters, own in trials if own.get(name) is not None]
        ordered = sorted(value for value, _ in there)
        found[name] = {
            "best": max(there)[1],
            "score": max(there)[0],
            "median": ordered[len(ordered) // 2],
            "worst": ordered[0],
            "ranks": {
                letters: 1 + sum(value < other for other, _ in there)
                for value, letters in there
                if letters in PAPER
            },
        }
    return found


def notes(numbers: Values) -> list[str]:
    """Return a paragraph on the number of pixels that a contact needs."""
    least = numbers["least_pixels"]
    return [
        "The camera sees the far wall at a grazing angle, and a ball there covers few pixels. A "
        f"contact (NormDiff) and a line across it (RGB2Normal) therefore need only {least} pixels, "
        f"instead of {LEAST_OF_NORMDIFF} and {LEAST_OF_RGB2NORMAL} as on the other sensors. A "
        "design with fewer pixels in one of its nine contacts gets no score."
    ]


def tables(numbers: Values) -> list[Table]:
    """Return tables of colourings, the best of all, tips, resins, and what NormDiff depends on."""
    colourings, resins = numbers["colourings"], numbers["resins"]
    return [
        Table(
            "Colourings of the paper's table (in brackets the paper's scores)",
            ["colouring", *OBJECTIVES.values()],
            [
                [letters, *(f"{shown(each[n], 4)} ({PAPER[letters][n]:g})" for n in OBJECTIVES)]
                for letters, each in colourings.items()
            ],
        ),
        Table(
            "The same colourings by other definitions of NormDiff; the last row is the rank "
            "correlation with the paper's scores",
            ["colouring", *BLIND],
            [
                *(
                    [name, *(shown(c["ways"][way]) for way in BLIND)]
                    for name, c in colourings.items()
                ),
                ["correlation", *(_correlation(colourings, way) for way in BLIND)],
            ],
        ),
        *([_table_of_all(numbers["all"])] if numbers["all"] else []),
        Table(
            "Tips by 2to3PW (which uses no random numbers: ± is over grids of chief rays)",
            ["tip", "2to3PW", "with triangles across folds and gaps"],
            [
                [tip, shown(each), shown(numbers["tips_with_leaps"][tip])]
                for tip, each in numbers["tips"].items()
            ],
        ),
        Table(
            "Resins",
            ["resin", *OBJECTIVES.values()],
            [
                [resin, *(shown(resins[name][resin]) for name in OBJECTIVES)]
                for resin in resins["normdiff"]
            ],
        ),
        Table(
            "NormDiff of other lights, coatings, resolutions and numbers of photons (one seed)",
            ["sensor", *BLIND, "pixels of the smallest contact"],
            [
                [name, *(number(each["scores"].get(way)) for way in BLIND), str(each["pixels"])]
                for name, each in numbers["why"].items()
            ],
        ),
    ]


def _table_of_all(every: Values) -> Table:
    """Return the table of the best of all colourings."""
    rows = [
        [
            title,
            every[name]["best"],
            *(number(every[name][key], 4) for key in ("score", "median", "worst")),
            f"{every[name]['ranks'].get('RGBRGBRG', 0):,}",
        ]
        for name, title in OBJECTIVES.items()
    ]
    heads = ["objective", "best", "best score", "median", "worst", "rank of RGBRGBRG"]
    return Table(f"All {every['colourings']:,} colourings, one seed", heads, rows)


def _correlation(colourings: Values, way: str) -> str:
    column = {letters: each["ways"][way] for letters, each in colourings.items()}
    return number(papers_order(column, "normdiff")[0], 2)


def draw(numbers: Values, pictures: Pictures) -> Figure:
    """Draw the scores beside the paper's table, tips, and resins by both objectives."""
    from optisense.figures import new_figure

    figure = new_figure(11.0, 6.4)
    axes = list(figure.subplots(2, 3).ravel())
    for place, (name, title) in enumerate(OBJECTIVES.items()):
        for colour, (letters, each) in zip(COLOURS, numbers["colourings"].items(), strict=False):
            if each[name]["mean"] is not None:
                axes[place].errorbar(
                    PAPER[letters][name],
                    each[name]["mean"],
                    each[name]["standard_deviation"] or 0.0,
                    fmt="o",
                    color=colour,
                    label=letters,
                    capsize=3,
                )
        finish(axes[place], f"{title} of five colourings", "paper", "here", legend=place == 1)
        line(axes[3 + place], numbers["resins"][name], "", COLOURS[place])
        finish(axes[3 + place], f"{title} of resins", "0 even shell, 10 almost flat inside")
    line(axes[2], numbers["tips"], "", COLOURS[2])
    finish(axes[2], "2to3PW of tips", "0 flat, 5 hemisphere, 10 conical")
    _draw_all(axes[5], numbers)
    return figure


def _draw_all(axes: Any, numbers: Values) -> None:
    """Draw NormDiff over its noise, for each sensor of the table."""
    for colour, (name, each) in zip(COLOURS, numbers["why"].items(), strict=False):
        ways = ("as scored", "noise of 15 % to either side", LITTLE_NOISE)
        values = [each["scores"].get(way) for way in ways]
        if None not in values:
            axes.plot([30, 15, 3], values, "o-", color=colour, label=name)
    finish(axes, "NormDiff over its noise", "noise, % of the colour", legend=True)


EXPERIMENT = Experiment(
    name="gelsight360",
    title="GelSight360: colours, tip and resin",
    about="five colourings and all 6,561; tips by 2to3PW; resins by NormDiff and RGB2Normal",
    steps=steps,
    claims=claims,
    tables=tables,
    draw=draw,
    notes=notes,
)
