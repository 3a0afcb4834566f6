"""Error of the gradient method's derivatives, compared with central differences of the scores.

``python -m benchmarks.gradients [--sensor NAME] [--dry]`` writes gradients.json and gradients.md
beside this file.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from rich.console import Console

import optisense
from benchmarks.results import machine, page_head, store, stored
from optisense.errors import NoDerivativeError
from optisense.objectives import evaluate
from optisense.optics import OpticalModel
from optisense.optics.camera.projection import Pose, RayCamera
from optisense.search import Around, SearchResult, SearchSpace, search
from optisense.search.evaluation.evaluator import DesignEvaluator
from optisense.search.methods.base import Problem
from optisense.search.methods.checked_gradients import (
    GRADIENT_BY,
    GRADIENT_HOLDS,
    GradientEvaluator,
)
from optisense.search.methods.gradient import Gradient
from optisense.search.methods.score_differences import STEP
from optisense.search.space.search_space import BoundSpace

if TYPE_CHECKING:
    import mitsuba as mi

FloatArray = NDArray[np.float64]

SENSORS = ("gelsight-mini-ideal", "gelbelt", "gelsight360", "gelsight-svelte")
OBJECTIVES = ("aoap", "2to3pw")
DIRECTIONS = 10
"""Number of random directions along which derivatives are compared; the differences of ten need 640
evaluations of a sensor."""
STEPS = (0.02, 0.01)
"""Steps of the central differences to either side, as fractions of the parameters' ranges."""
STABLE = 0.05
"""Largest relative difference of the differences over the two steps; derivatives are compared only
where they agree so well."""
WITHIN = 0.05
"""Largest relative error of a correct gradient: of the difference along a direction, or of the
average slope of random directions where the difference is smaller."""
RAYS = (480, 360)
"""Number of chief rays across and down of a true score."""
SHIFTS = 16
"""Number of scores, each with rays through other points of the pixels, whose mean is a true score:
an edge that is parallel to a row of pixels moves past all of the row's rays at once."""
CAMERA = {"camera.position": Around(1.0), "camera.turn": Around(3.0), "camera.fov": Around(3.0)}
"""Range of the camera's position (mm) and rotation (degrees)."""
CAGE = Around(1.0)
"""Range of each coordinate of a cage's points (mm), that of the camera's position."""
VIEW = {"camera.position.z": (0.0, 8.0), "camera.fov": Around(20.0)}
"""Parameters of the search on GelSight360, in mm and degrees."""
VIEW_BUDGET = {"gradient": 40, "cma-es": 200}
"""Number of trials of the search on GelSight360 by each method; CMA-ES, which has
no derivatives, gets five times as many."""


def main() -> None:
    """Run the benchmark, print its results and write them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sensor", choices=(*SENSORS, "search"), help="measure one part only")
    parser.add_argument("--dry", action="store_true", help="print only, write no results")
    options = parser.parse_args()
    console = Console()
    found = stored("gradients") | {"machine": machine()}
    for part in (options.sensor,) if options.sensor else (*SENSORS, "search"):
        console.print(f"[dim]{part}")
        found[part] = searches() if part == "search" else sensor(part)
        console.print_json(json.dumps(found[part]))
        if not options.dry:
            store("gradients", found, _markdown(found))


def sensor(name: str) -> dict[str, Any]:
    """Return the derivatives of both objectives of a built-in sensor, beside true differences.

    The parameters are the pose and field of view of its camera and the points of its cages.
    """
    design = optisense.load(name)
    ranges: dict[str, Any] = dict(CAMERA)
    ranges |= {f"cages.{cage}.points": CAGE for cage in design.cages}
    space = SearchSpace(ranges).bind(design)
    span = space.upper - space.lower
    random = np.random.default_rng(0)
    ways = [way / np.linalg.norm(way) for way in random.normal(size=(DIRECTIONS, space.size))]
    true = TrueScores(space)
    # (directions, steps, objectives)
    differences = np.array(
        [
            [
                (true(space.start + h * way * span) - true(space.start - h * way * span)) / (2 * h)
                for h in STEPS
            ]
            for way in ways
        ]
    )
    found: dict[str, Any] = {"parameters": space.size}
    for number, objective in enumerate(OBJECTIVES):
        found[objective] = _compared(space, objective, ways, differences[:, :, number])
    return found


class TrueScores:
    """Mean of each objective over rays through several points of the pixels."""

    def __init__(self, space: BoundSpace) -> None:
        self.space = space
        self.model = _Shifted(space.prepared)
        # The R2 sequence of Roberts (2018): successive points fill the pixel evenly.
        steps = np.array([0.7548776662466927, 0.5698402909980532])
        self.shifts = (np.arange(SHIFTS)[:, None] * steps + 0.5) % 1.0 - 0.5

    def __call__(self, point: FloatArray) -> FloatArray:
        """Return the values (objectives,) at a point (n,) of the space."""
        self.model.set_design(self.space.apply(point))
        total = np.zeros(len(OBJECTIVES))
        for shift in self.shifts:
            self.model.shift = shift
            scores = evaluate(self.model, list(OBJECTIVES), ray_resolution=RAYS)
            total += [scores[objective].value for objective in OBJECTIVES]
        return total / len(self.shifts)


class _Shifted(OpticalModel):
    """Model whose camera sends its rays through points beside the middles of the pixels."""

    shift: FloatArray = np.zeros(2)

    def camera(self, resolution: tuple[int, int] | None = None) -> RayCamera:
        usual = super().camera(resolution)
        fields = {field.name: getattr(usual, field.name) for field in dataclasses.fields(usual)}
        return _ShiftedCamera(**fields, shift=(float(self.shift[0]), float(self.shift[1])))


@dataclasses.dataclass(frozen=True)
class _ShiftedCamera(RayCamera):
    """Camera whose rays are shifted to the right and down, in pixels."""

    shift: tuple[float, float] = (0.0, 0.0)

    def rays(
        self, x: mi.Float, y: mi.Float, pose: Pose | None = None
    ) -> tuple[mi.Point3f, mi.Vector3f]:
        return super().rays(x + self.shift[0], y + self.shift[1], pose)


def _compared(
    space: BoundSpace, objective: str, ways: list[FloatArray], differences: FloatArray
) -> dict[str, Any]:
    """Return the gradient that the method uses at the start, beside the true differences.

    Args:
        ways: unit vectors (parameters,) of the directions, in shares of the ranges.
        differences: central differences (directions, steps) of the true score.
    """
    problem = Problem(space, (objective,), DIRECTIONS)
    method = Gradient(problem)
    evaluator = method.evaluator(DesignEvaluator(space, [objective], apart=False))
    assert isinstance(evaluator, GradientEvaluator)
    span = space.upper - space.lower
    outcome = evaluator(space.start, 0)
    assert outcome.gradient is not None, outcome.failure
    method.tell(space.start[None], [outcome])
    by_rays = None
    with suppress(NoDerivativeError):
        by_rays = evaluator.gradient(space.start)[1] * span
    rows = []
    for way, (far, near) in zip(ways, differences.tolist(), strict=True):
        row = {"far": far, "near": near, "used": float(outcome.gradient * span @ way)}
        rows.append(row if by_rays is None else {**row, "by_rays": float(by_rays @ way)})
    return {
        "source": outcome.parts[objective][GRADIENT_BY],
        "holds": outcome.parts[objective][GRADIENT_HOLDS],
        "notes": method.notes(),
        "length": float(np.linalg.norm(outcome.gradient * span)),
        "directions": rows,
    }


def searches() -> dict[str, Any]:
    """Search the view of GelSight360 by AOAP with the gradient method and with CMA-ES."""
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
        *page_head("Derivatives of chief-ray scores", "benchmarks.gradients"),
        "The derivatives at the built-in design are compared with central differences of the score "
        f"along {DIRECTIONS} random directions. The parameters are the camera's position (± 1 mm), "
        "rotation and field of view (± 3 degrees), and all points of the sensor's cage if it has "
        f"one (± 1 mm). The differences are over {STEPS[1]:.0%} of the ranges to both sides. A "
        f"direction is *stable* if differences over {STEPS[0]:.0%} agree with them to "
        f"{STABLE:.0%}. The score is the mean of {SHIFTS} scores of {RAYS[0]} x {RAYS[1]} rays, "
        "each through other points of the pixels. Errors are relative to the difference, or to the "
        "average slope of random directions (the length of the gradient divided by the square root "
        "of the number of parameters) if the difference is smaller. *Result of the check* is the "
        "result of a test at the start of a search: the search compares its gradient with "
        f"differences of its own score (320 rays across) over {STEP / 2:.1%} and {STEP:.0%} of the "
        "ranges. The last column says whether the errors of the method are within "
        f"{WITHIN:.0%}, or whether the check reports that they may not be.",
        "",
        "| sensor | score | parameters | stable | error of derivatives of rays (median, largest) | "
        "used by the method | error of the method (median, largest) | result of the check | "
        f"within {WITHIN:.0%}, or reported |",
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
    typical = row["length"] / np.sqrt(parameters)

    def off(key: str) -> FloatArray:
        found = [
            abs(each[key] - each["near"]) / max(abs(each["near"]), typical)
            for each in stable
            if key in each
        ]
        return np.array(found)

    def shown(errors: FloatArray) -> str:
        return f"{np.median(errors):.1%}, {errors.max():.1%}" if len(errors) else "none"

    used = off("used")
    right = bool(len(used)) and bool(used.max() <= WITHIN)
    verdict = "within" if right else "reported" if not row["holds"] else "neither"
    says = "the gradient is correct" if row["holds"] else "no stable derivative"
    return (
        f"| {name} | {objective} | {parameters} | {len(stable)} of {len(row['directions'])} | "
        f"{shown(off('by_rays'))} | {row['source']} | {shown(used)} | {says} | {verdict} |"
    )


if __name__ == "__main__":
    main()
