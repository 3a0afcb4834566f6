"""Experiment on perception tasks: whether the objectives show the trends of estimated quantities.

It reproduces the section "Why choosing those objective functions?" of the OptiSense paper: the
misalignment angle to a plane and the radius of a cylinder, estimated by a random forest, and their
signal-to-noise ratios, over the specularity of the coating, on the cylindrical and the spherical
GelSight Mini.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from paper.claims import Claim, Table
from paper.evaluations import perception, sensor
from paper.experiment import Experiment, Finding, Pictures, Steps, Values
from paper.figures import COLOURS, finish, line
from paper.mini_shapes import OBJECTIVES, SHAPES, curves, score_units
from paper.spread import Spread, by_seed, exceeds, is_larger, number, shown, spearman, spread
from paper.text import listed
from paper.unit import Unit

if TYPE_CHECKING:
    from matplotlib.figure import Figure

CURVED = {label: SHAPES[label] for label in ("cylinder", "sphere")}
TASKS = {"misalignment": ("angle", "degrees"), "cylinder-radius": ("radius", "mm")}
SHINY = 0.6
"""Specularity from which on coatings count as shiny; they are compared with those below."""

PAPERS_ERROR = 0.5
"""Smallest mean absolute error of the angle in the OptiSense paper, degrees."""

FOLLOWS = 0.5
"""Mean rank correlation above which an objective counts as showing the trend of the tasks."""


def steps(settings: Values) -> Steps:
    """Compute both tasks and both objectives for each shape, coating and seed."""
    seeds = range(settings["seeds"])
    asked = [
        Unit(
            perception,
            {
                "design": sensor(name, {"coating.specularity": value}),
                "tasks": settings["tasks"],
                "samples": settings["samples"],
                "seed": seed,
                "photons": settings["photons"],
            },
            f"tasks on the {label}, specularity {value:g}, seed {seed}",
        )
        for label, name in CURVED.items()
        for value in settings["specularities"]
        for seed in seeds
    ]
    records = yield [*asked, *score_units(settings, CURVED)]
    answers = iter(records)
    found: Values = {"tasks": {}, "scores": curves(settings, records[len(asked) :], CURVED)}
    for label in CURVED:
        found["tasks"][label] = {
            task: {"error": {}, "snr": {}, "guess": {}} for task in settings["tasks"]
        }
        for value in settings["specularities"]:
            rows = [next(answers).values for _ in seeds]
            for task, columns in found["tasks"][label].items():
                for key, column in columns.items():
                    column[f"{value:g}"] = spread([row.get(task, {}).get(key) for row in rows])
    found["agreement"] = {label: _agreement(found, label) for label in CURVED}
    return Finding(found)


def _agreement(found: Values, label: str) -> Values:
    """Return the rank correlation of each objective with each measure over the coatings.

    It is 1 for the same order: small errors and large ratios where scores are high.
    """
    measures = {
        f"{task} {key}": (columns[key], -1.0 if key == "error" else 1.0)
        for task, columns in found["tasks"][label].items()
        for key in ("error", "snr")
    }
    agreement: Values = {}
    for name in OBJECTIVES:
        column = found["scores"][label][name]
        agreement[name] = {}
        for measure, (values, sign) in measures.items():
            pairs = [
                (column[x]["mean"], sign * values[x]["mean"])
                for x in column
                if column[x]["mean"] is not None and values[x]["mean"] is not None
            ]
            ranks, chance = spearman([a for a, _ in pairs], [b for _, b in pairs])
            agreement[name][measure] = {
                "correlation": ranks,
                "chance": chance,
                "coatings": len(pairs),
            }
    return agreement


def claims(numbers: Values) -> list[Claim]:
    """Return the paper's statements on tasks, with verdicts."""
    found = []
    for label in CURVED:
        errors = numbers["tasks"][label]["misalignment"]["error"]
        low = [e for x, e in errors.items() if float(x) < SHINY and e["mean"] is not None]
        if low:
            lowest = min(low, key=lambda error: float(error["mean"]))
            above = exceeds(lowest, 2.0 * PAPERS_ERROR)
            guess = next(iter(numbers["tasks"][label]["misalignment"]["guess"].values()))
            found.append(
                Claim(
                    f"On the {label}, the error of the angle is as low as {PAPERS_ERROR:g} "
                    "degrees.",
                    f"{shown(lowest)} degrees at best; a guess without images has an error of "
                    f"{number(guess['mean'])}",
                    None if above is None else not above,
                    "The paper gives neither the number of contacts in the training of the random "
                    "forest, nor the range of the angles, nor the noise of the camera. The error "
                    "decreases with more contacts. Up to twice the paper's value counts as "
                    "agreement.",
                )
            )
        for task, (what, unit) in TASKS.items():
            found += _trends(numbers["tasks"][label][task], label, what, unit)
    for name, title in OBJECTIVES.items():
        found.append(_follows(numbers, name, title))
    return found


def _trends(columns: Values, label: str, what: str, unit: str) -> list[Claim]:
    """Return whether shiny coatings are worse, by error and by signal-to-noise ratio."""
    found = []
    for key, worse, title in (("error", 1, f"error ({unit})"), ("snr", -1, "SNR")):
        column = columns[key]
        shiny = {value: each for value, each in column.items() if float(value) >= SHINY}
        dull = _mean_of(each for value, each in column.items() if value not in shiny)
        bright = _mean_of(shiny.values())
        larger = is_larger(bright, dull)
        found.append(
            Claim(
                f"On the {label}, the {what} is estimated less well with shiny coatings: {title}.",
                f"{shown(dull)} below a specularity of {SHINY:g}, {shown(bright)} at "
                f"{listed(list(shiny))}",
                None if larger is None else larger == (worse > 0),
                "With few contacts, the error and the SNR of a random forest are uncertain. A "
                "metallic coating can also reflect light to places that had none.",
            )
        )
    return found


def _mean_of(cells: Iterable[Spread]) -> Spread:
    """Return the mean over coatings, seed by seed."""
    means = []
    for values in zip(*(each["values"] for each in cells), strict=True):
        there = [value for value in values if value is not None]
        means.append(sum(there) / len(there) if there else None)
    return spread(means)


def _follows(numbers: Values, name: str, title: str) -> Claim:
    """Return whether an objective shows the trends of the tasks, by its mean rank correlation.

    The mean over sensors and measures is computed for each seed, so that its scatter is known.
    """
    means = []
    for seed in by_seed({key: numbers[key] for key in ("tasks", "scores")}):
        cells = [each for label in CURVED for each in _agreement(seed, label)[name].values()]
        means.append(spread([each["correlation"] for each in cells])["mean"])
    found = spread(means)
    cells = [each for label in CURVED for each in numbers["agreement"][label][name].values()]
    all_seeds = [each["correlation"] for each in cells]
    there = [value for value in spread(all_seeds)["values"] if value is not None]
    return Claim(
        f"{title} shows the trends of the tasks.",
        "too few coatings with a score"
        if found["mean"] is None or not there
        else f"mean rank correlation {sum(there) / len(there):+.2f} (from {min(there):+.2f} to "
        f"{max(there):+.2f}); of single seeds {shown(found, 2)}",
        exceeds(found, FOLLOWS),
        "The tasks press large, slightly tilted objects in the middle and use mean colours; the "
        "objectives press small, steep balls at nine places. A coating may suit one better than "
        "the other. For NormDiff, colours that differ by up to 30 %, far more than the camera "
        "noise of the tasks, are similar. It therefore rewards colours that change quickly with "
        "the tilt more than steady ones. The correlation omits coatings without a score.",
    )


def tables(numbers: Values) -> list[Table]:
    """Return tables of errors, ratios and objectives for each shape, and of the correlations."""
    found = []
    for label in CURVED:
        tasks, scores = numbers["tasks"][label], numbers["scores"][label]
        columns = {
            **{f"{TASKS[t][0]} error ({TASKS[t][1]})": tasks[t]["error"] for t in tasks},
            **{f"{TASKS[t][0]} SNR": tasks[t]["snr"] for t in tasks},
            **{title: scores[name] for name, title in OBJECTIVES.items()},
        }
        rows = [
            [x, *(shown(column[x]) for column in columns.values())] for x in scores["rgb2normal"]
        ]
        found.append(Table(f"The {label}", ["specularity", *columns], rows))
    rows = [
        [
            f"{label}, {OBJECTIVES[name]}",
            *(f"{number(c['correlation'], 2)} ({number(c['chance'], 2)})" for c in cells.values()),
        ]
        for label, agreement in numbers["agreement"].items()
        for name, cells in agreement.items()
    ]
    heads = list(next(iter(numbers["agreement"].values()))["rgb2normal"])
    found.append(
        Table(
            "Rank correlation of objectives with tasks (1: the same order; in brackets the "
            "probability that a random order agrees as well)",
            ["", *heads],
            rows,
        )
    )
    return found


def draw(numbers: Values, pictures: Pictures) -> Figure:
    """Draw errors, ratios and objectives over specularity."""
    from optisense.figures import new_figure

    figure = new_figure(11.0, 6.4)
    axes = list(figure.subplots(2, 3).ravel())
    for colour, label in zip(COLOURS, CURVED, strict=False):
        for row, (task, (what, unit)) in enumerate(TASKS.items()):
            columns = numbers["tasks"][label][task]
            line(axes[3 * row], columns["error"], label, colour)
            finish(axes[3 * row], f"Error of the {what}", "specularity", unit, legend=True)
            line(axes[3 * row + 1], columns["snr"], label, colour)
            finish(axes[3 * row + 1], f"SNR of the {what}", "specularity")
        for row, (name, title) in enumerate(OBJECTIVES.items()):
            line(axes[3 * row + 2], numbers["scores"][label][name], label, colour)
            finish(axes[3 * row + 2], title, "specularity")
    return figure


EXPERIMENT = Experiment(
    name="tasks",
    title="Perception tasks",
    about="angle and radius estimated with curved Minis, SNR, and correlation with objectives",
    steps=steps,
    claims=claims,
    tables=tables,
    draw=draw,
)
