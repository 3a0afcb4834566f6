"""Rank correlation of the objectives with the errors of the full reconstruction task.

``python -m benchmarks.reading [--sensor NAME ...] [--specularity S ...] [--wide W] [--again]``
writes reading.json and reading.md beside this file, sensor by sensor; what is there is not measured
again. Each built-in sensor is given coatings from diffuse to shiny. Scores are those of
`optisense.evaluate`; the error beside them is that of `optisense.tasks.reconstruct`: 24 balls at
random places, a network, three other shapes to reconstruct, an elastic skin.
"""

from __future__ import annotations

import argparse
import time
from typing import Any

import numpy as np
from rich.console import Console
from scipy.stats import spearmanr

from benchmarks.results import FOLDER, machine, page_head, say_if_busy, store, stored
from optisense import OpticalModel, evaluate, sensors
from optisense.design import SensorDesign, set_value
from optisense.objectives import Evaluation, Settings
from optisense.tasks import ReconstructionSettings, reconstruct

SENSORS = (
    "gelsight-mini-ideal",
    "gelsight-mini-ideal-cylindrical",
    "gelbelt",
    "gelsight-svelte",
    "gelsight360",
)
SPECULARITIES = (0.0, 0.2, 0.4, 0.6, 0.8)
"""Specularities (0 to 1) of the coatings, from diffuse to shiny."""
WIDE = 320
"""Width (pixels) of the pictures of the scores; twice as many where contacts are small."""
SMALL_CONTACTS = ("gelsight360", "gelsight-svelte")
"""Sensors with a large view, in whose pictures a contact has few pixels."""
TASK_WIDE = 160
"""Width (pixels) of the pictures of the task."""
BALLS = 24
"""Number of presses that the task's network learns from; 40 are usual, and take longer."""
PHOTONS = 300_000
"""Number of photons of each image, fewer than usual, since each task renders many."""
OBJECTIVES = ("reading", "rgb2normal", "normdiff")
SCORES = {"reading": -1.0, "mean_of_places": -1.0, "rgb2normal": 1.0, "normdiff": 1.0}
"""Sign of each score of a row: 1 if a higher value is better and -1 otherwise."""


def main() -> None:
    """Measure the missing rows, and write both files after each sensor and coating."""
    options = _options()
    console = Console()
    about = machine()
    say_if_busy(console, about)
    content: dict[str, Any] = {"machine": about, "rows": []}
    if not options.again:
        content["rows"] = stored("reading").get("rows", [])
    for name in options.sensor:
        model: OpticalModel | None = None
        for specularity in options.specularity:
            if any(_key(row) == (name, specularity) for row in content["rows"]):
                continue
            design = set_value(sensors.load(name), "coating.specularity", specularity)
            if model is None:
                model = OpticalModel(design)
            else:
                model.set_design(design)
            row = {"sensor": name, "specularity": specularity} | _measure(model, design, options)
            console.print(row)
            content["rows"] = sorted([*content["rows"], row], key=_order)
            store("reading", content, _page(content))
    (FOLDER / "reading.md").write_text(_page(content), encoding="utf-8")


def _measure(
    model: OpticalModel, design: SensorDesign, options: argparse.Namespace
) -> dict[str, Any]:
    width, height = design.camera.resolution

    def size(across: int) -> tuple[int, int]:
        return across, round(across * height / width)

    across = options.wide * (2 if design.name in SMALL_CONTACTS else 1)
    settings = Settings(resolution=size(across), photons=PHOTONS)
    began = time.process_time()
    scores = evaluate(Evaluation(model, settings), list(OBJECTIVES))
    scored = time.process_time()
    task = reconstruct(
        model, ReconstructionSettings(presses=BALLS, resolution=size(TASK_WIDE), photons=PHOTONS)
    ).to_dict()
    found: dict[str, Any] = {
        "normal_error": round(task["normal_error"], 2),
        "cpu_s": {
            "scores": round(scored - began, 1),
            "task": round(time.process_time() - scored, 1),
        },
    }
    for name, score in scores.items():
        found[name] = None if score.failure else round(score.value, 4)
    found["mean_of_places"] = round(scores["reading"].parts["mean_of_places"], 4)
    return found


def agreement(rows: list[dict[str, Any]], score: str) -> tuple[float, int]:
    """Return Spearman's rank correlation of a score with the task, and the number of rows."""
    known = [row for row in rows if row[score] is not None]
    if len(known) < 3:
        return float("nan"), len(known)
    goodness = [SCORES[score] * row[score] for row in known]
    found = spearmanr(goodness, [-row["normal_error"] for row in known]).statistic
    return float(found), len(known)


def _page(content: dict[str, Any]) -> str:
    rows = content["rows"]
    lines = [
        *page_head("Scores compared with the reconstruction task", "benchmarks.reading"),
        "Errors of normals are in degrees. `reading` is the median over places, and the next",
        "column is the mean over places. Higher values of RGB2Normal and NormDiff are better. The",
        f"images are {WIDE} pixels wide for the scores ({2 * WIDE} for",
        f"{' and '.join(SMALL_CONTACTS)}) and {TASK_WIDE} for the task, with {BALLS} balls and",
        f"{PHOTONS:,} photons.",
        "",
        "| sensor | specularity | error in the task | reading | mean of places | RGB2Normal "
        "| NormDiff |",
        "|---|---|---|---|---|---|---|",
    ]
    for row in rows:
        cells = [
            "fails" if row[name] is None else f"{row[name]:.{digits}f}"
            for name, digits in zip(SCORES, (1, 1, 3, 1), strict=True)
        ]
        lines.append(
            f"| {row['sensor']} | {row['specularity']:g} | {row['normal_error']:.1f} | "
            + " | ".join(cells)
            + " |"
        )
    lines += [
        "",
        "Rank correlation (Spearman) with the task, over the coatings of one sensor and over all",
        "sensors and coatings (1 means that better scores always have smaller errors):",
        "",
        "| | reading | mean of places | RGB2Normal | NormDiff |",
        "|---|---|---|---|---|",
    ]
    groups = {name: [row for row in rows if row["sensor"] == name] for name in SENSORS}
    for title, some in [*groups.items(), ("all", rows)]:
        if len(some) > 2:
            found = [agreement(some, score)[0] for score in SCORES]
            cells = ["" if np.isnan(each) else f"{each:.2f}" for each in found]
            lines.append(f"| {title} | " + " | ".join(cells) + " |")
    seconds = [row["cpu_s"] for row in rows]
    lines += [
        "",
        f"The table has {len(rows)} sensors and coatings. The median processor time is "
        f"{np.median([each['scores'] for each in seconds]):.0f} s for all three scores, and "
        f"{np.median([each['task'] for each in seconds]):.0f} s for the task.",
        "",
    ]
    return "\n".join(lines)


def _key(row: dict[str, Any]) -> tuple[str, float]:
    return row["sensor"], row["specularity"]


def _order(row: dict[str, Any]) -> tuple[int, float]:
    return SENSORS.index(row["sensor"]), row["specularity"]


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sensor", nargs="+", choices=SENSORS, default=list(SENSORS))
    parser.add_argument("--specularity", nargs="+", type=float, default=list(SPECULARITIES))
    parser.add_argument("--wide", type=int, default=WIDE, help="pixels across a score's pictures")
    parser.add_argument("--again", action="store_true", help="measure also what is there")
    return parser.parse_args()


if __name__ == "__main__":
    main()
