"""``python -m benchmarks.agreement``: do the objectives rank coatings as a robot's tasks do?

The OptiSense paper claims that RGB2Normal and NormDiff, over the specularity of the coating, show
the trend of two perception tasks' errors and of their signal-to-noise ratio. Here one sensor after
the other gets coatings of several specularities; each is scored by both objectives and by both
tasks, with the same contacts, seeds and camera noise for all coatings. Spearman's rank correlation
says how far the rankings agree. Stopped at any moment, the same command continues.
"""

from __future__ import annotations

import argparse
import itertools
import json
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from scipy.stats import rankdata

from benchmarks import results
from optisense.objectives import evaluate
from optisense.objectives.score import json_ready
from optisense.optics import OpticalModel
from optisense.optics.response import auto_exposure
from optisense.sensors import load
from optisense.tasks import CylinderRadius, Misalignment, SampleSettings, perceive
from optisense.tasks.records import read_json, write_json, write_whole

Row = dict[str, Any]
"""One coating: its specularity, its scores (None with a failure beside), errors and SNRs."""

SENSORS = ("gelsight-mini-cylindrical", "gelsight-mini")
SPECULARITIES = (0.0, 0.1, 0.2, 0.35, 0.5, 0.75, 1.0)
SAMPLES = 60
PHOTONS = 1_000_000
SEED = 1

# Smaller than a user would take: the features are means and spreads over many pixels.
RESOLUTIONS = {"misalignment": (32, 24), "cylinder-radius": (64, 48)}
OBJECTIVE_RESOLUTION = 320, 240

DARKER = 0.25
"""Of the exposure that suits the untouched sensor, for the objectives: at the whole of it they
refuse shiny coatings, whose contacts are overexposed. Tasks take pictures at the whole of it."""

FOLDER = Path(__file__).parent
CACHE = FOLDER / ".cache" / "agreement"
JSON = FOLDER / "agreement.json"
MARKDOWN = FOLDER / "agreement.md"

OBJECTIVES = {"rgb2normal": "RGB2Normal", "normdiff": "NormDiff"}
MEASURES = {
    "misalignment_error": ("angle error (degrees)", -1),
    "radius_error": ("radius error (mm)", -1),
    "misalignment_snr": ("angle SNR", 1),
    "radius_snr": ("radius SNR", 1),
}
"""What is compared with the objectives: its title, and 1 where more is better."""


def main() -> None:
    """Measure what is missing, and write agreement.json and agreement.md after each coating."""
    options = _options()
    console = Console()
    made: dict[str, list[Row]] = {}
    for sensor in options.sensors:
        model: OpticalModel | None = None
        made[sensor] = []
        for value in options.specularities:
            folder = CACHE / f"{sensor}-{options.samples}-{options.photons}" / f"{value:g}"
            if not (folder / "row.json").exists():
                model = model or OpticalModel(load(sensor), options.variant)
                model.update("coating.specularity", value)
                write_json(folder / "row.json", json_ready(measure(model, value, options, folder)))
            row = read_json(folder / "row.json")
            made[sensor].append(row)
            console.print(f"{sensor} {_line(row)}", highlight=False)
        if not options.dry:
            _write(made, options)
    if options.dry:
        console.print_json(json.dumps({name: agreement(rows) for name, rows in made.items()}))


def measure(model: OpticalModel, value: float, options: argparse.Namespace, folder: Path) -> Row:
    """One coating: both objectives, both tasks. Finished samples are kept in the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    blank = model.render([], OBJECTIVE_RESOLUTION, options.photons, seed=SEED)
    scores = evaluate(
        model,
        list(OBJECTIVES),
        resolution=OBJECTIVE_RESOLUTION,
        photons=options.photons,
        seed=SEED,
        exposure=DARKER * auto_exposure(blank.radiance),
    )
    row: Row = {"specularity": value}
    for name, score in scores.items():
        row[name] = None if score.failure else score.value
        row[f"{name}_failure"] = str(score.failure or "")
    for task, name in ((Misalignment(), "misalignment"), (CylinderRadius(), "radius")):
        settings = SampleSettings(
            options.samples, SEED, resolution=RESOLUTIONS[task.name], photons=options.photons
        )
        result = perceive(task, model, settings, folder=folder / task.name)
        row[f"{name}_error"] = result.reading.error
        row[f"{name}_error_spread"] = result.reading.spread
        row[f"{name}_guess"] = result.reading.guess
        row[f"{name}_snr"] = result.snr
    return row


def agreement(rows: list[Row]) -> dict[str, dict[str, dict[str, float]]]:
    """Spearman's correlation of each objective with each measure; 1 is the same ranking.

    Coatings that an objective can't score are left out of its comparisons.
    """
    found: dict[str, dict[str, dict[str, float]]] = {}
    for objective in OBJECTIVES:
        scored = [row for row in rows if row[objective] is not None]
        found[objective] = {}
        for name, (_, sign) in MEASURES.items():
            ranks, chance = spearman(
                [row[objective] for row in scored], [sign * row[name] for row in scored]
            )
            found[objective][name] = {
                "correlation": ranks,
                "chance": chance,
                "coatings": len(scored),
            }
    return found


def spearman(first: list[float], second: list[float]) -> tuple[float, float]:
    """The rank correlation, and the share of all orders of `second` that reach it or more.

    NaN where there are fewer than three pairs or all are alike. The share is exact, so it grows
    with the factorial of their number; nine at most are meant.
    """
    a, b = rankdata(first), rankdata(second)
    if len(a) < 3 or not (np.isfinite([*first, *second]).all() and np.ptp(a) and np.ptp(b)):
        return float("nan"), float("nan")
    a, b = (ranks - ranks.mean() for ranks in (a, b))
    scale = np.sqrt((a**2).sum() * (b**2).sum())
    orders = np.array(list(itertools.permutations(b)))
    reached = float(a @ b / scale)
    return reached, float((orders @ a / scale >= reached - 1e-9).mean())


def _write(made: dict[str, list[Row]], options: argparse.Namespace) -> None:
    before = read_json(JSON) if JSON.exists() else {"sensors": {}}
    sensors = before["sensors"] | {
        name: {"rows": rows, "agreement": agreement(rows)} for name, rows in made.items()
    }
    values = {
        "machine": results.machine(),
        "settings": {
            "samples": options.samples,
            "photons": options.photons,
            "seed": SEED,
            "resolutions": RESOLUTIONS | {"objectives": OBJECTIVE_RESOLUTION},
        },
        "sensors": sensors,
    }
    write_json(JSON, json_ready(values))
    write_whole(MARKDOWN, lambda path: path.write_text(_markdown(values), encoding="utf-8"))


def _markdown(values: dict[str, Any]) -> str:
    settings = values["settings"]
    lines = [
        "# Do the objectives rank coatings as tasks do?",
        "",
        "Written by `python -m benchmarks.agreement`; do not edit.",
        "",
        f"{settings['samples']} contacts a task, {settings['photons']:,} photons, camera noise of "
        "1.5 levels of 255; errors are mean absolute errors of a cross-validated random forest, "
        "± their standard deviation among its folds. Tasks' pictures are exposed to suit the "
        f"untouched sensor; the objectives judge images {DARKER:g} times as bright, since they "
        "refuse contacts that are overexposed, as those of shiny coatings are.",
    ]
    for sensor, found in values["sensors"].items():
        rows = found["rows"]
        titles = [title for title, _ in MEASURES.values()]
        lines += ["", f"## {sensor}", "", _cells("specularity", *OBJECTIVES.values(), *titles)]
        lines.append(_cells(*["---"] * (3 + len(titles))))
        for row in rows:
            lines.append(
                _cells(
                    f"{row['specularity']:g}",
                    *("none" if row[name] is None else f"{row[name]:.4g}" for name in OBJECTIVES),
                    *(
                        f"{row[f'{name}_error']:.3f} ± {row[f'{name}_error_spread']:.3f}"
                        for name in ("misalignment", "radius")
                    ),
                    *(f"{row[f'{name}_snr']:.2f}" for name in ("misalignment", "radius")),
                )
            )
        guess = rows[0]
        lines += [
            "",
            f"Guessing the mean would be off by {guess['misalignment_guess']:.2f} degrees and "
            f"{guess['radius_guess']:.2f} mm.",
            "",
            *(
                f"- No {OBJECTIVES[name]} at {row['specularity']:g}: {row[f'{name}_failure']}."
                for row in rows
                for name in OBJECTIVES
                if row[name] is None
            ),
            "",
            "Rank correlation over the coatings that have a score (1: the same ranking, -1: the "
            "opposite one; in brackets the chance that a random ranking agrees as well):",
            "",
            _cells("", *titles),
            _cells(*["---"] * (1 + len(titles))),
        ]
        for objective, cells in found["agreement"].items():
            shown = [f"{c['correlation']:+.2f} ({c['chance']:.3f})" for c in cells.values()]
            lines.append(_cells(OBJECTIVES[objective], *shown))
    return "\n".join(lines) + "\n"


def _cells(*texts: str) -> str:
    return "| " + " | ".join(texts) + " |"


def _line(row: Row) -> str:
    return ", ".join(f"{n} {v:.4g}" for n, v in row.items() if isinstance(v, float))


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.agreement", description=__doc__)
    parser.add_argument("--sensors", nargs="+", default=SENSORS, help="built-in names or folders")
    parser.add_argument("--specularities", nargs="+", type=float, default=SPECULARITIES)
    parser.add_argument("--samples", type=int, default=SAMPLES, help="contacts of each task")
    parser.add_argument("--photons", type=int, default=PHOTONS)
    parser.add_argument("--variant", choices=("auto", "llvm", "cuda"), default="auto")
    parser.add_argument("--dry", action="store_true", help="print only, write no results")
    return parser.parse_args()


if __name__ == "__main__":
    main()
