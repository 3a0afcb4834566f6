"""How near the gradient method's derivatives are to central differences of the true scores.

``python -m benchmarks.gradients [--sensor NAME] [--dry]`` writes gradients.json and gradients.md
beside this file.
"""

from __future__ import annotations

import argparse
import json
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rich.console import Console

import optisense
from benchmarks.results import machine
from optisense.errors import NoDerivativeError
from optisense.search import Around, SearchResult, SearchSpace, search
from optisense.search.evaluation.evaluator import DesignEvaluator
from optisense.search.methods.base import Problem
from optisense.search.methods.gradient import Gradient, SlopeEvaluator
from optisense.search.space.search_space import BoundSpace

FloatArray = NDArray[np.float64]

FOLDER = Path(__file__).parent
SENSORS = ("gelsight-mini", "gelbelt", "gelsight360", "gelsight-svelte")
OBJECTIVES = ("aoap", "2to3pw")
DIRECTIONS = 10
STEPS = (0.04, 0.02)
"""Steps of the central differences to either side, as fractions of the parameters' ranges."""
STABLE = 0.05
"""Differences over the two steps that agree to this part of themselves are what derivatives are
compared with."""
ACROSS = (641, 603, 577)
"""Rays across the picture. The differences are those of the mean of three scores: an edge that is
parallel to a row of pixels moves past all of the row at once, and past those of another grid at
another time."""
CAMERA = {"camera.position": Around(1.0), "camera.turn": Around(3.0), "camera.fov": Around(3.0)}
"""mm and degrees."""
CAGE = Around(1.0)
VIEW = {"camera.position.z": (0.0, 8.0), "camera.fov": Around(20.0)}
"""What is searched on GelSight360: mm and degrees."""
VIEW_BUDGET = {"gradient": 40, "cma-es": 200}


def main() -> None:
    """Measure, print and write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sensor", choices=(*SENSORS, "search"), help="measure one part only")
    parser.add_argument("--dry", action="store_true", help="print only, write no results")
    options = parser.parse_args()
    console = Console()
    path = FOLDER / "gradients.json"
    found = json.loads(path.read_text(encoding="utf-8")) if path.is_file() else {}
    found["machine"] = machine()
    for part in (options.sensor,) if options.sensor else (*SENSORS, "search"):
        console.print(f"[dim]{part}")
        found[part] = searches() if part == "search" else sensor(part)
        console.print_json(json.dumps(found[part]))
        if not options.dry:
            path.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
            (FOLDER / "gradients.md").write_text(_markdown(found), encoding="utf-8")


def sensor(name: str) -> dict[str, Any]:
    """Both objectives of a built-in sensor, by its camera and the points of its cage if any."""
    design = optisense.load(name)
    ranges: dict[str, Any] = dict(CAMERA)
    ranges |= {f"cages.{cage}.points": CAGE for cage in design.cages}
    space = SearchSpace(ranges).bind(design)
    return {
        "parameters": space.size,
        **{objective: _compared(space, objective) for objective in OBJECTIVES},
    }


def _compared(space: BoundSpace, objective: str) -> dict[str, Any]:
    problem = Problem(space, (objective,), DIRECTIONS)
    evaluator = Gradient(problem).evaluator(DesignEvaluator(space, [objective], apart=False))
    assert isinstance(evaluator, SlopeEvaluator)
    span = space.upper - space.lower
    _, gradient, source = evaluator.checked_slope(space.start, 0)
    by_rays = None
    with suppress(NoDerivativeError):
        by_rays = evaluator.slope(space.start)[1] * span
    goals = [
        DesignEvaluator(space, [objective], {"ray_resolution": (w, w * 3 // 4)}, apart=False)
        for w in ACROSS
    ]

    def score(point: FloatArray) -> float:
        return float(np.mean([goal(point, 0).scores[objective] for goal in goals]))

    random = np.random.default_rng(0)
    rows = []
    for _ in range(DIRECTIONS):
        way = random.normal(size=space.size)
        way /= np.linalg.norm(way)
        far, near = (
            (score(space.start + h * way * span) - score(space.start - h * way * span)) / (2 * h)
            for h in STEPS
        )
        row = {"far": far, "near": near, "used": float(gradient * span @ way)}
        rows.append(row if by_rays is None else {**row, "by_rays": float(by_rays @ way)})
    length = float(np.linalg.norm(gradient * span))
    return {"source": source, "length": length, "directions": rows}


def searches() -> dict[str, Any]:
    """The view of GelSight360 by AOAP: by gradient, and by CMA-ES."""
    found: dict[str, Any] = {}
    for method, budget in VIEW_BUDGET.items():
        result: SearchResult = search(
            optisense.load("gelsight360"), VIEW, "aoap", method=method, budget=budget
        )
        best = result.best
        found[method] = {
            "trials": len(result.trials) - 1,
            "start": result.start.score,
            "best": best.score,
            "values": dict(best.values),
            "notes": list(result.notes),
        }
    return found


def _markdown(found: dict[str, Any]) -> str:
    about = found["machine"]
    lines = [
        "# Derivatives of chief-ray scores",
        "",
        "Written by `python -m benchmarks.gradients`; do not edit.",
        "",
        f"Along {DIRECTIONS} random directions in the space of camera position (± 1 mm), turn and "
        "field of view (± 3 degrees) and all points of the sensor's cage if it has one (± 1 mm), "
        "the derivative is compared with central differences of the true score, over "
        f"{STEPS[1]:.0%} of the ranges to both sides, where those over {STEPS[0]:.0%} agree with "
        f"them to {STABLE:.0%} (stable).",
        "",
        "| sensor | score | parameters | stable | derivatives of rays off by (median, largest) | "
        "of the gradient's length | the method uses | which is off by (median, largest) | "
        "of the gradient's length |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for name in SENSORS:
        for objective in OBJECTIVES if name in found else ():
            lines.append(_line(name, found[name]["parameters"], objective, found[name][objective]))
    if "search" in found:
        lines += [
            "",
            "## GelSight360's camera by AOAP: z from 0 to 8 mm, field of view 108 to 148 degrees",
            "",
            "| method | trials | start | best | z (mm) | field of view (degrees) |",
            "|---|---|---|---|---|---|",
        ]
        for method, row in found["search"].items():
            z, fov = row["values"]["camera.position.z"], row["values"]["camera.fov"]
            lines.append(
                f"| {method} | {row['trials']} | {row['start']:.3f} | {row['best']:.3f} | "
                f"{z:.2f} | {fov:.1f} |"
            )
    lines += ["", f"{about['processor']}, {about['cores']} cores, {about['date']}."]
    return "\n".join(lines) + "\n"


def _line(name: str, parameters: int, objective: str, row: dict[str, Any]) -> str:
    stable = [
        each
        for each in row["directions"]
        if abs(each["far"] - each["near"]) <= STABLE * abs(each["near"])
    ]

    def off(key: str) -> str:
        if not stable or key not in stable[0]:
            return "none | none"
        errors = np.array([abs(each[key] - each["near"]) for each in stable])
        parts = errors / [abs(each["near"]) for each in stable]
        return f"{np.median(parts):.1%}, {parts.max():.1%} | {errors.max() / row['length']:.1%}"

    return (
        f"| {name} | {objective} | {parameters} | {len(stable)} of {len(row['directions'])} | "
        f"{off('by_rays')} | {row['source']} | {off('used')} |"
    )


if __name__ == "__main__":
    main()
