"""Made-up answers of units, in the form that real work gives (see test_evaluations.py)."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from paper import Experiment, Finding, Record, Unit

Score = Callable[[str, dict[str, Any], int], float | None]
"""Function of the name of an objective, a design as plain values, and a seed."""


def alike(objective: str, design: dict[str, Any], seed: int) -> float:
    """All designs score the same but for the seed."""
    return 0.5 + 0.01 * seed


def values(unit: Unit, score: Score) -> dict[str, Any]:
    """Made-up result of a unit."""
    asked: dict[str, Any] = dict(unit.inputs)
    seed = asked.get("seed", asked.get("settings", {}).get("seed", 0))
    design = asked["design"]
    kind = unit.work.__name__
    if kind == "scores":
        goals = asked["objectives"]
        found = {name: score(name, design, seed) for name in goals}
        failed = {name: "made up" for name, value in found.items() if value is None}
        parts = {"coverage": 0.5, "mean_cosine_of_rays_that_arrive": 0.6}
        parts["pixels_that_see_the_surface"] = 0.4
        return {"scores": found, "failures": failed, "parts": dict.fromkeys(goals, parts)}
    if kind == "relit_scores":
        found = {
            letters: {
                "scores": {
                    name: score(name, {**design, "colouring": letters}, seed)
                    for name in asked["objectives"]
                }
            }
            for letters in asked["colourings"]
        }
        return {"colourings": found, "failures": {}}
    if kind == "scores_by_readings":
        found = {
            exposure: {
                name: {way: score(name, design, seed) for way in ways}
                for name, ways in asked["variants"].items()
            }
            for exposure in asked["exposures"]
        }
        return {"scores": found}
    if kind == "variants_of_score":
        found = {name: score(asked["objective"], design, seed) for name in asked["variants"]}
        return {"scores": found, "failures": {}, "pixels": [60, 80]}
    if kind == "stretch":
        return {"median": 2.0 if design["change"] else 3.0, "tenth": 5.0}
    if kind == "picture":
        return {"radiance": 1.0 + 0.1 * seed, "pixels_in_contact": 100}
    if kind == "perception":
        return {name: {"error": 1.0, "guess": 5.0, "snr": 4.0} for name in asked["tasks"]}
    if kind == "searched":
        return searched(asked, score)
    if kind == "bent_mirror":
        first = {"aoap": 0.24, "stretch": 1.2}
        return {"first": first, "best": {"aoap": 0.63, "stretch": 1.1}}
    assert kind == "image_times"
    sizes = len(asked["resolutions"])
    times = [[[2.0 + 0.1 * k, 3.9]] * sizes for k in range(len(asked["seeds"]))]
    noise = [[0.03] * sizes] * (len(times) - 1)
    about = {"photons": 5_000_000, "first": 6.0, "noise": noise, "pixels_in_contact": 99}
    return {**about, "new_light": times, "light_kept": times}


def searched(asked: dict[str, Any], score: Score) -> dict[str, Any]:
    goals = asked["objectives"]
    first = {name: score(name, asked["design"], 0) for name in goals}
    best = {name: None if value is None else 2.7 * value for name, value in first.items()}
    found = {
        "start": {**first, "parts": {}},
        "best": {**best, "parts": {}},
        "values": {"cages.M1.blend": 0.5},
        "course": [0.2, 0.3, 0.6],
        "failed": 0,
    }
    if asked.get("all"):
        letters = ("GRRGGRRG", "RGBRGBRG", "BBBBBBBB")
        found["trials"] = [
            [list(each), dict.fromkeys(goals, 0.1 * k)] for k, each in enumerate(letters)
        ]
    return found


@pytest.fixture()
def answered(tmp_path: Path) -> Callable[..., tuple[Finding, list[Record]]]:
    """What an experiment finds when its units are answered by made-up scores, or all fail."""

    def answer(
        experiment: Experiment,
        settings: dict[str, Any],
        score: Score = alike,
        failure: str | None = None,
    ) -> tuple[Finding, list[Record]]:
        return _answered(experiment, settings, tmp_path, score, failure)

    return answer


def _answered(
    experiment: Experiment,
    settings: dict[str, Any],
    folder: Path,
    score: Score,
    failure: str | None,
) -> tuple[Finding, list[Record]]:
    drawn = folder / "picture.npz"
    np.savez(drawn, picture=np.full((6, 8, 3), 99, dtype=np.uint8))
    steps, records = experiment.steps(settings), []
    batch = next(steps)
    while True:
        answers = []
        for unit in batch:
            has_picture = unit.work.__name__ == "picture" and failure is None
            found = {} if failure is not None else values(unit, score)
            file = drawn if has_picture else None
            answers.append(Record(unit.label, found, failure, 1.0, 1.9, file))
        records += answers
        try:
            batch = steps.send(answers)
        except StopIteration as end:
            return end.value, records
