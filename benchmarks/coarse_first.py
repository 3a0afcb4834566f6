"""Searches by coarse scores first, beside the same searches by full scores.

``python -m benchmarks.coarse_first [--only PART] [--dry]`` writes coarse_first.json and
coarse_first.md beside this file. The best designs of both searches of a kind get full scores with
seeds that neither search has used. Times are processor times, so another program may run meanwhile.
A search pauses after `MOST_SECONDS`; the same command goes on with it, in build/coarse_first.
"""

from __future__ import annotations

import json
import sys
import time
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import optisense
from benchmarks.results import measure_parts
from optisense.design import SensorDesign
from optisense.search import Plan, SearchSpace, Study, run_study
from optisense.search.evaluation.evaluator import DesignEvaluator
from optisense.search.evaluation.relit import RelitEvaluator
from optisense.search.study.progress import SearchProgress
from optisense.sensors.from_meshes import design_from_meshes

PAD = Path(__file__).parent.parent / "docs/examples/pad-sensor/sensor.yaml"

FOLDER = Path(__file__).parent.parent / "build/coarse_first"
"""Folder of searches that are not finished."""

MOST_SECONDS = 500.0
"""Wall time after which a search pauses, s."""

NEW_SEEDS = (1001, 1002, 1003)
"""Seeds with which the best designs are compared."""

POWER_TRIALS, POWER_RENDERED = 100, 8
"""Number of trials over powers of lights, and of those that are rendered as well."""


class Case(NamedTuple):
    """A search.

    Attributes:
        sensor: name of a built-in sensor, or file of a recipe.
        space: what may change.
        goal: objective.
        method: method of the search.
        budget: number of trials; None for the method's own.
        requirements: conditions.
    """

    sensor: str | Path
    space: dict[str, tuple[float, ...]]
    goal: str
    method: str
    budget: int | None
    requirements: tuple[str, ...] = ()

    def design(self) -> SensorDesign:
        """Return the design from which the search starts."""
        if isinstance(self.sensor, Path):
            return design_from_meshes(self.sensor).design
        return optisense.load(self.sensor)


CASES = {
    "cylinder": Case(
        "gelsight-mini-ideal-cylindrical",
        {"lights.*.shift.z": (0.0, 6.0), "coating.specularity": (0.0, 0.4)},
        "reading",
        "cma-es",
        48,
    ),
    "pad": Case(
        PAD,
        {
            "lights.*.shift.z": (-1.0, 4.0),
            "camera.fov": (40.0, 62.2),
            "coating.specularity": (0.0, 0.3),
        },
        "reading.mean_of_places",
        "cma-es",
        48,
        ("coverage>=0.98",),
    ),
    "coatings": Case(
        "gelsight-mini-ideal", {"coating.specularity": (0.0, 0.8, 41)}, "rgb2normal", "grid", None
    ),
}
"""Searches by name, of some minutes each with full scores. Lights move over the height of the guide
or the housing (mm), specularity (0 to 1) varies over what spray coatings have, and the field of
view (degrees) up to that of the built-in camera. 48 trials are four generations of CMA-ES; 41
coatings are steps of 0.02."""


def main() -> None:
    """Run the benchmark, print its results and write them."""
    parts = {
        f"{name}-{'coarse' if coarse else 'full'}": partial(searched, name, coarse)
        for name in CASES
        for coarse in (False, True)
    }
    measure_parts("coarse_first", __doc__, {**parts, "powers": powers}, _table)


def searched(name: str, coarse: bool) -> dict[str, Any]:
    """Run a search, and score its best design with new seeds."""
    case = CASES[name]
    design = case.design()
    plan = Plan(
        space=SearchSpace(case.space),
        goals=[case.goal],
        method=case.method,
        budget=case.budget,
        requirements=list(case.requirements),
        coarse_first=coarse,
    )
    folder = FOLDER / f"{name}-{'coarse' if coarse else 'full'}"
    spent = folder / "processor-seconds.json"
    study = Study.open(folder) if folder.exists() else Study.create(folder, design, plan)
    seconds = float(json.loads(spent.read_text())) if spent.exists() else 0.0
    began, before = time.monotonic(), time.process_time()

    def pause(progress: SearchProgress) -> None:
        if time.monotonic() - began > MOST_SECONDS:
            raise KeyboardInterrupt

    result = run_study(study, progress=pause)
    seconds += time.process_time() - before
    spent.write_text(json.dumps(seconds))
    if result.interrupted:
        sys.exit(f"{folder.name} is paused: run the same command to continue")
    full, best = study.evaluator(), result.best
    again = [full(best.vector, seed).scores[study.objective] for seed in NEW_SEEDS]
    return {
        "goal": case.goal,
        "trials": len(result.trials) - 1,
        "full_scores": sum(len(trial.fresh) for trial in result.trials),
        "processor_seconds": round(seconds, 1),
        "best": {each: round(float(value), 4) for each, value in best.values.items()},
        "score": round(float(np.mean(again)), 4),
        "deviation": round(float(np.std(again, ddof=1)), 4),
    }


def powers() -> dict[str, Any]:
    """Processor time of trials over powers of lights, from layers and by renderings."""
    space = SearchSpace({"lights.*.flux": (1.0, 10.0)}).bind(optisense.load("gelsight-mini-ideal"))
    usual = DesignEvaluator(space, ["rgb2normal"], {"photons": "normal"})
    relit = RelitEvaluator(usual)
    random = np.random.default_rng(0)
    points = space.lower + (space.upper - space.lower) * random.random((POWER_TRIALS, space.size))
    began = time.process_time()
    quick = [relit(point, 0).scores["rgb2normal"] for point in points]
    layered = time.process_time() - began
    usual(space.start, 0)  # compiles the kernels, and traces the light of its seed
    began = time.process_time()
    slow = [usual(point, 0).scores["rgb2normal"] for point in points[:POWER_RENDERED]]
    rendered = time.process_time() - began
    apart = np.abs(np.array(quick[:POWER_RENDERED]) - slow).max()
    return {
        "trials": POWER_TRIALS,
        "processor_seconds": round(layered, 1),
        "seconds_a_rendered_trial": round(rendered / POWER_RENDERED, 2),
        "largest_difference": float(apart),
    }


def _score(row: dict[str, Any]) -> str:
    return f"{row['score']:.4g} ± {row['deviation']:.2g}"


def _load(row: dict[str, Any]) -> str:
    return f"{row['machine']['load_at_start']:.1f}"


def _table(found: dict[str, Any]) -> str:
    lines = [
        "# Searches that use coarse scores first",
        "",
        "| search | trials | full scores in the coarse search | processor time, s: full, coarse "
        "| share | load of the machine: full, coarse "
        "| score of the best with three new seeds: full, coarse |",
        "|---|---|---|---|---|---|---|",
    ]
    for name, case in CASES.items():
        full, coarse = found.get(f"{name}-full"), found.get(f"{name}-coarse")
        if coarse is None:
            continue
        times, scores, share = ["not measured"], ["not measured"], ""
        loads = ["not measured"]
        if full is not None:
            times, scores = [f"{full['processor_seconds']:.0f}"], [_score(full)]
            loads = [_load(full)]
            share = f"{100 * coarse['processor_seconds'] / full['processor_seconds']:.0f} %"
        times.append(f"{coarse['processor_seconds']:.0f}")
        scores.append(_score(coarse))
        loads.append(_load(coarse))
        lines.append(
            f"| {name}, `{case.goal}`, {case.method} | {coarse['trials']} "
            f"| {coarse['full_scores']} | {', '.join(times)} | {share} | {', '.join(loads)} "
            f"| {', '.join(scores)} |"
        )
    lines += [
        "",
        "Lower values of `reading` are better; the table gives the negative values that the search "
        "maximises. ± is the standard deviation over the seeds. Processor times are longer on a "
        "busy machine (load at the start above 1), so that ratios of searches under different "
        "loads are approximate.",
        "",
    ]
    if "powers" in found:
        row = found["powers"]
        lines += [
            f"Powers of GelSight Mini's lights by RGB2Normal: {row['trials']} trials from layers "
            f"take {row['processor_seconds']:.0f} s, including the start of the search. Renderings "
            f"would take {row['trials'] * row['seconds_a_rendered_trial']:.0f} s "
            f"({row['seconds_a_rendered_trial']} s each, with photons traced once). The scores "
            f"differ by at most {row['largest_difference']:.1g}.",
            "",
        ]
    for name in CASES:
        for kind in ("full", "coarse"):
            row = found.get(f"{name}-{kind}")
            if row is not None:
                values = ", ".join(f"{path} {value:g}" for path, value in row["best"].items())
                lines.append(f"- {name}, {kind}: {values}")
    about = next(iter(found.values()))["machine"]
    lines += ["", f"{about['processor']}, {about['cores']} cores, {about['date']}."]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    main()
