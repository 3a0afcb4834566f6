"""Small real evaluations of units, in the form that experiments read."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from comparing import SCORE_ROUNDING

import optisense as ots
from paper import Record
from paper.evaluations import (
    NINE,
    axes_ratio,
    design_of,
    perception,
    picture,
    relit_scores,
    scores,
    searched,
    sensor,
    stretch,
    variants_of_score,
)
from paper.gelsight360 import every_colouring
from paper.objects import OBJECTS
from paper.speed import image_times

IMAGES = {"resolution": [160, 120], "photons": 60_000, "seed": 3}
COARSE = {"resolution": [160, 120], "photons": 60_000, "places": [[0.0, 0.0], [4.0, 3.0]]}
PRESSES = {**COARSE, "seed": 3}
SAME = 1e-6
"""Sums over threads differ by rounding."""

GOALS = ["rgb2normal", "normdiff"]


def test_a_design_is_its_dimensions_and_what_is_set_in_it() -> None:
    design = design_of(
        sensor("gelsight-mini-ideal", {"coating.specularity": 0.3}, gel_size=[20.0, 18.0])
    )
    assert design.coating.specularity == 0.3
    assert np.ptp(design.meshes["gel"].bounds, axis=0)[:2] == pytest.approx([20.0, 18.0])


@pytest.mark.slow
def test_scores_are_those_of_evaluate_whatever_was_asked_before(tmp_path: Path) -> None:
    asked = {"objectives": GOALS, "settings": PRESSES}
    shiny = sensor("gelsight-mini-ideal", {"coating.specularity": 0.3})
    found = [
        scores({"design": design, **asked}, tmp_path).values["scores"]
        for design in (shiny, sensor("gelsight-mini-ideal"), shiny)
    ]
    plain = ots.evaluate(ots.load("gelsight-mini-ideal"), GOALS, **_tuples(PRESSES))
    assert found[1] == pytest.approx({name: score.value for name, score in plain.items()}, rel=SAME)
    assert found[0] == pytest.approx(found[2], rel=SAME)
    assert found[0]["normdiff"] != pytest.approx(found[1]["normdiff"], rel=1e-3)


@pytest.mark.slow
def test_an_objective_that_fails_leaves_a_gap_with_its_reason(tmp_path: Path) -> None:
    settings = {**PRESSES, "exposure": 1e6}
    design = sensor("gelsight-mini-ideal")
    found = scores({"design": design, "objectives": GOALS, "settings": settings}, tmp_path).values
    assert found["scores"] == dict.fromkeys(GOALS)
    assert all("overexposed" in reason for reason in found["failures"].values())


@pytest.mark.slow
def test_relit_scores_are_those_of_a_design_with_these_colours(tmp_path: Path) -> None:
    groups = ["red", "green", "blue"]
    asked = {"objectives": ["normdiff"], "settings": PRESSES}
    relit = relit_scores(
        {
            "design": sensor("gelsight-mini-ideal"),
            "groups": groups,
            "colourings": ["RGB", "GGB"],
            "own": {"least_pixels": 20},
            **asked,
        },
        tmp_path,
    ).values["colourings"]
    design = sensor("gelsight-mini-ideal", {"lights.red.colour": [0.0, 1.0, 0.0]})
    again = scores({"design": design, **asked}, tmp_path).values["scores"]["normdiff"]
    assert relit["GGB"]["scores"]["normdiff"] == pytest.approx(again, rel=SCORE_ROUNDING)
    assert relit["RGB"]["scores"]["normdiff"] > again  # two colours tell less than three


def test_less_noise_confuses_less(tmp_path: Path) -> None:
    variants = {"much": {"noise": 0.3}, "little": {"noise": 0.03}}
    found = variants_of_score(
        {
            "design": sensor("gelsight-mini-ideal"),
            "objective": "normdiff",
            "variants": variants,
            "settings": PRESSES,
        },
        tmp_path,
    ).values
    assert found["scores"]["little"] > found["scores"]["much"]
    assert len(found["pixels"]) == len(PRESSES["places"])


@pytest.mark.parametrize("name", list(OBJECTS))
def test_objects_leave_their_mark(name: str, tmp_path: Path) -> None:
    asked: dict[str, Any] = {"design": sensor("gelsight-mini-ideal"), **IMAGES}
    found = picture({**asked, "contacts": [f"object:{name}@0,0:0.5"]}, tmp_path)
    assert found.pictures["picture"].shape == (120, 160, 3)
    assert found.values["pixels_in_contact"] > 20
    assert found.values["radiance"] > 0.0


def test_nine_balls_are_seen(tmp_path: Path) -> None:
    asked: dict[str, Any] = {"design": sensor("gelsight-mini-ideal"), **IMAGES}
    assert picture({**asked, "contacts": NINE}, tmp_path).values["pixels_in_contact"] > 90


def test_a_camera_straight_above_keeps_shapes_and_a_slant_stretches_them(tmp_path: Path) -> None:
    design = sensor("gelsight-mini-ideal")
    straight = stretch({"design": design, "ray_resolution": [32, 24]}, tmp_path).values
    assert straight["median"] == pytest.approx(1.0, abs=0.1)
    angles = np.radians([0.0, 30.0, 60.0])  # a plane tilted about one axis: 1 / cos
    first = np.column_stack([1.0 / np.cos(angles), 0.0 * angles, 0.0 * angles])
    second = np.tile([0.0, 1.0, 0.0], (3, 1))
    assert axes_ratio(first, second) == pytest.approx(1.0 / np.cos(angles))
    sheared = axes_ratio(np.array([[1.0, 0.0, 0.0]]), np.array([[1.0, 1.0, 0.0]]))
    assert sheared == pytest.approx((1.0 + np.sqrt(5.0)) ** 2 / 4.0)  # golden ratio squared


@pytest.mark.slow
def test_a_task_is_read_and_its_samples_kept(tmp_path: Path) -> None:
    asked: Mapping[str, Any] = {
        "design": sensor("gelsight-mini-ideal"),
        "tasks": {"cylinder-radius": [48, 36]},
        "samples": 10,
        "seed": 1,
        "photons": 60_000,
    }
    first = perception(asked, tmp_path).values
    (samples,) = tmp_path.rglob("samples.csv")
    kept = samples.read_bytes()
    assert perception(asked, tmp_path).values == first
    assert samples.read_bytes() == kept
    own = first["cylinder-radius"]
    assert 0.0 < own["error"] < 3.0 * own["guess"]


@pytest.mark.slow
def test_a_searched_mirror_can_be_built_again(tmp_path: Path) -> None:
    asked: dict[str, Any] = {
        "design": sensor("gelsight-svelte"),
        "space": {"cages.M1.blend": [0.0, 1.0]},
        "objectives": ["aoap"],
        "method": "gradient",
        "budget": 2,
        "seed": 0,
        "settings": {"ray_resolution": [32, 24]},
    }
    found = searched(asked, tmp_path).values
    assert found["course"][0] == found["start"]["aoap"]
    assert found["course"] == sorted(found["course"])
    assert found["best"]["aoap"] > found["start"]["aoap"]  # it is not the mirror of the start
    better = sensor("gelsight-svelte", {"cages.M1.blend": found["values"]})
    again = scores(
        {"design": better, "objectives": ["aoap"], "settings": asked["settings"]}, tmp_path
    ).values
    assert again["scores"]["aoap"] == pytest.approx(found["best"]["aoap"], rel=1e-6)
    assert searched(asked, tmp_path).values == found  # from the study that is there


@pytest.mark.slow
def test_all_colourings_are_told_by_their_letters(tmp_path: Path) -> None:
    asked: dict[str, Any] = {
        "design": sensor("gelsight-mini-ideal"),
        "space": {"lights.*.colour": ["R", "G", "B"]},
        "objectives": GOALS,
        "method": "light-colours",
        "seed": 0,
        "settings": {**COARSE, "least_pixels": 5},
        "all": True,
    }
    record = Record("all", searched(asked, tmp_path).values, None, 0.0, 0.0)
    found = every_colouring(record)
    assert found["colourings"] == 27
    assert sorted(found["normdiff"]["best"]) == ["B", "G", "R"]  # three tell more than two
    assert found["normdiff"]["worst"] < found["normdiff"]["median"] < found["normdiff"]["score"]


@pytest.mark.slow
def test_times_of_images(tmp_path: Path) -> None:
    asked: dict[str, Any] = {
        "design": sensor("gelsight-mini-ideal"),
        "resolutions": [[80, 60], [120, 90]],
        "photons": 60_000,
        "seeds": [0, 1],
        "ball": [1.5, 0.5],
    }
    found = image_times(asked, tmp_path).values
    for kind in ("new_light", "light_kept"):
        assert np.shape(found[kind]) == (2, 2, 2)  # seeds, resolutions, wall and processor
    light = np.subtract(found["new_light"], found["light_kept"])
    assert light[:, 0] == pytest.approx(light[:, 1])
    assert (light[..., 1] > 0.0).all()  # processor seconds
    assert found["first"] > 0.0 and all(0.0 < noise < 1.0 for noise in found["noise"][0])


def _tuples(values: Mapping[str, Any]) -> dict[str, Any]:
    return {k: tuple(v) if isinstance(v, list) else v for k, v in values.items()}
