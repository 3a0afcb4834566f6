"""All 6,561 colourings of GelSight360, and separate renderings of five of them.

``python -m benchmarks.colourings [--photons MILLIONS] [--out STUDY] [--dry]`` writes
colourings.json and colourings.md beside this file.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import resource
import time
from collections.abc import Iterator
from typing import Any

import numpy as np
from rich.console import Console

import optisense
from benchmarks.results import machine, page_head, store, stored
from optisense.design import SensorDesign, set_value
from optisense.objectives import Evaluation, Settings
from optisense.optics import OpticalModel
from optisense.search import Plan, SearchResult, SearchSpace, Study, Trial
from optisense.search.evaluation.evaluator import Evaluator
from optisense.search.executors import SerialRunner
from optisense.search.study.loop import StudyRun
from optisense.search.study.rescoring import fresh_seeds

OBJECTIVES = ("rgb2normal", "normdiff")
COLOURS = {"lights.lg*.colour": ["R", "G", "B"]}
DRAWN = 5
"""Number of colourings that are rendered separately, which takes far longer than scoring layers."""
OTHER_SEED = 999
"""Seed of the separate renderings of colourings, which no image of the search has."""
TARGET_SECONDS = 600.0
"""Longest time (s) that scoring all colourings may take on two cores; the goal is ten minutes."""

PAPERS = ("GRRGGRRG", "GBBRRGGB", "GRRBBGGR", "GBRBRGBR", "RGBRGBRG")
"""The colourings of the OptiSense paper's table, the original first."""

Scores = dict[str, float]


def main() -> None:
    """Search, render some colourings separately, and write the results after each part."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--photons", type=float, default=5.0, help="millions an image")
    parser.add_argument("--out", help="keep the study in this folder", metavar="STUDY")
    parser.add_argument("--dry", action="store_true", help="print only, write no results")
    options = parser.parse_args()
    photons = round(options.photons * 1e6)
    console = Console()
    about = machine()
    design = optisense.load("gelsight360")
    began, spent = time.perf_counter(), time.process_time()
    plan = Plan(
        space=SearchSpace(COLOURS),
        goals=OBJECTIVES,
        method="light-colours",
        settings={"photons": photons},
    )
    runner = KeptRunner()
    result = StudyRun(Study.create(options.out, design, plan), runner.begin).run()
    total, processor = time.perf_counter() - began, time.process_time() - spent
    trials = [trial for trial in result.trials if not trial.is_start]
    seconds = [trial.outcome.seconds for trial in result.trials]
    found: dict[str, Any] = {
        "machine": {**about, "load_at_end": round(os.getloadavg()[0], 2)},
        "colourings": len(trials),
        "photons_an_image": photons,
        "seconds": {
            "all": round(total, 1),
            "processor": round(processor, 1),
            "layers": round(seconds[0], 1),
            "a_colouring": round(float(np.median(seconds[1:])), 4),
        },
        "memory_gb": round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20, 2),
        "best": {name: _best(trials, name) for name in OBJECTIVES},
        "of_the_paper": _of_the_paper(trials),
        "after_fresh_seeds": {
            "colouring": letters(result.best),
            "rgb2normal": result.best.fresh_score(),
            "standard_deviation": result.best.fresh_spread(),
        },
        "rendered_by_themselves": [],
    }
    if not options.dry:
        write(found)
    console.print(f"{len(trials):,} colourings in {total:.0f} s, {processor:.0f} s of processors")
    assert runner.evaluator is not None
    for row in compared(result, runner.evaluator, trials, photons, console):
        found["rendered_by_themselves"].append(row)
        if not options.dry:
            write(found)
    console.print_json(json.dumps(found))


def write(found: dict[str, Any]) -> None:
    """Store a run beside those with other numbers of photons."""
    runs = stored("colourings") | {str(found["photons_an_image"]): found}
    store("colourings", runs, markdown(runs))


def letters(trial: Trial) -> str:
    """Return the colours of the groups as one word, such as RGBRGBRG."""
    return "".join(str(value)[0].upper() for value in _named(trial).values())


def _named(trial: Trial) -> dict[str, str]:
    shares = {"1,0,0": "R", "0,1,0": "G", "0,0,1": "B"}
    return {name: shares.get(str(v), str(v)) for name, v in trial.values.items()}


def _best(trials: list[Trial], name: str) -> dict[str, Any]:
    best = max(trials, key=lambda trial: trial.scores[name])
    values = [trial.scores[name] for trial in trials]
    return {
        "colouring": letters(best),
        "score": best.scores[name],
        "median_of_all": float(np.median(values)),
        "worst": float(np.min(values)),
    }


def _of_the_paper(trials: list[Trial]) -> dict[str, Scores]:
    known = {letters(trial): trial for trial in trials}
    return {each: dict(known[each].scores) for each in PAPERS}


class KeptRunner:
    """Keeps the evaluator of a study, with the layers that it has rendered."""

    evaluator: Evaluator | None = None

    def begin(self, evaluator: Evaluator) -> SerialRunner:
        """Return a runner in this process."""
        self.evaluator = evaluator
        return SerialRunner(evaluator)


def compared(
    result: SearchResult, evaluator: Evaluator, trials: list[Trial], photons: int, console: Console
) -> Iterator[dict[str, Any]]:
    """Yield the scores of random colourings, from layers and from renderings of their own.

    The noise of an objective is the standard deviation over seeds, pooled over the colourings.
    """
    drawn = np.random.default_rng(5).choice(len(trials), DRAWN, replace=False)
    chosen = [trials[number] for number in drawn]
    seeds = fresh_seeds(result.study.settings.seed)
    scatter = [
        [dict(trial.scores), *(dict(evaluator(trial.vector, seed).scores) for seed in seeds)]
        for trial in chosen
    ]
    noise = {
        name: math.sqrt(
            float(np.mean([np.var([each[name] for each in of], ddof=1) for of in scatter]))
        )
        for name in OBJECTIVES
    }
    console.print(f"five colourings from the layers of {1 + len(seeds)} seeds")
    for number, (trial, samples) in enumerate(zip(chosen, scatter, strict=True)):
        own = rendered(trial.design, photons, OTHER_SEED)
        again = rendered(trial.design, photons, result.study.settings.seed) if not number else {}
        row: dict[str, Any] = {"colouring": letters(trial)}
        for name in OBJECTIVES:
            values = np.array([each[name] for each in samples])
            row[name] = {
                "in_the_search": trial.scores[name],
                "rendered_with_the_same_seed": again.get(name),
                "from_layers": float(values.mean()),
                "noise": noise[name],
                "rendered_with_another_seed": own[name],
                "difference_in_noises": abs(own[name] - float(values.mean()))
                / (noise[name] * math.sqrt(1.0 + 1.0 / len(values))),
            }
        console.print(f"{letters(trial)} rendered by itself")
        yield row


def rendered(design: SensorDesign, photons: int, seed: int) -> Scores:
    """Return the scores of a design from a new model and new images."""
    plain = set_value(design, "name", "by itself")
    return scores_of(Evaluation(OpticalModel(plain), Settings(photons=photons, seed=seed)))


def scores_of(evaluation: Evaluation) -> Scores:
    """Return the values of both objectives."""
    found = optisense.evaluate(evaluation, list(OBJECTIVES))
    return {name: score.value for name, score in found.items()}


def markdown(runs: dict[str, Any]) -> str:
    """Return the results of all runs as Markdown."""
    lines = [
        *page_head("All colourings of GelSight360", "benchmarks.colourings"),
        "All 3^8 = 6,561 assignments of red, green and blue to the eight light groups are scored",
        "by RGB2Normal and NormDiff, from one rendering of each group. The goal is "
        f"{TARGET_SECONDS:.0f} s",
        "on two cores, rendering included. The time also includes scoring the best colourings",
        "again with three fresh seeds. Processor time is that of all threads; on an idle machine,",
        "the wall time is shorter.",
        "",
        "| photons | wall time | processor time | part for the layers | per colouring | memory "
        "| load |",
        "|---|---|---|---|---|---|---|",
    ]
    for found in runs.values():
        seconds, about = found["seconds"], found["machine"]
        each = seconds.get("a_colouring")
        lines.append(
            f"| {found['photons_an_image']:,} | {seconds['all']:.0f} s | "
            f"{seconds['processor']:.0f} s | {_or_dash(seconds.get('layers'), ' s')} | "
            f"{_or_dash(None if each is None else 1000 * each, ' ms')} | "
            f"{found.get('memory_gb', '-')} GB | "
            f"{about['load_at_start']} on {about['cores']} cores |"
        )
    about = next(iter(runs.values()))["machine"]
    lines += ["", f"Measured on {about['date']}: {about['processor']}."]
    for found in runs.values():
        if "best" in found:
            lines += _scores(found)
        if found.get("rendered_by_themselves"):
            lines += _agreement(found)
    return "\n".join(lines) + "\n"


def _scores(found: dict[str, Any]) -> list[str]:
    lines = [
        "",
        f"## Scores, {found['photons_an_image']:,} photons",
        "",
        "| objective | best | best score | median of all | worst |",
        "|---|---|---|---|---|",
    ]
    for name, best in found["best"].items():
        lines.append(
            f"| {name} | {best['colouring']} | {best['score']:.4g} | {best['median_of_all']:.4g} | "
            f"{best['worst']:.4g} |"
        )
    fresh = found["after_fresh_seeds"]
    lines += [
        "",
        "All scores of this table are computed with the seed of the search. The best score of",
        "thousands therefore tends to be too high. The search scores the best colourings again",
        f"with three fresh seeds and selects {fresh['colouring']}: RGB2Normal "
        f"{fresh['rgb2normal']:.3f} ± {fresh['standard_deviation']:.3f} (standard deviation).",
    ]
    lines += [
        "",
        "Scores of the OptiSense paper's colourings on this geometry, with the seed of the search:",
        "",
    ]
    lines += ["| colouring | NormDiff | RGB2Normal |", "|---|---|---|"]
    for each, scores in found["of_the_paper"].items():
        lines.append(f"| {each} | {scores['normdiff']:.2f} | {scores['rgb2normal']:.3f} |")
    return lines


def _agreement(found: dict[str, Any]) -> list[str]:
    lines = [
        "",
        f"## Layers and separate renderings, {found['photons_an_image']:,} photons",
        "",
        "Random colourings are rendered separately with another seed, and compared with the mean",
        "over four seeds from layers. The noise is the standard deviation over these seeds, pooled",
        "over the five colourings. The difference is in units of the noise of both; a value of",
        "three or more has a probability of one in a hundred. The last column is a separate",
        "rendering with the seed of the search.",
        "",
        "| colouring | objective | from layers | noise | rendered | difference in noises | in the "
        "search | same seed |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for row in found["rendered_by_themselves"]:
        for name in OBJECTIVES:
            one = row[name]
            again = one["rendered_with_the_same_seed"]
            lines.append(
                f"| {row['colouring']} | {name} | {one['from_layers']:.4f} | "
                f"{one['noise']:.4f} | {one['rendered_with_another_seed']:.4f} | "
                f"{one['difference_in_noises']:.1f} | {one['in_the_search']:.6f} | "
                f"{'' if again is None else f'{again:.6f}'} |"
            )
    return lines


def _or_dash(value: float | None, unit: str) -> str:
    return "-" if value is None else f"{value:.0f}{unit}"


if __name__ == "__main__":
    main()
