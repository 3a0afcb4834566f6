"""A search that is watched, given up, cut short by the end of Blender and gone on with, by mouse
and keys.

The steps build on one another, as a user's do.
"""

from __future__ import annotations

import sqlite3
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from .bench import Bench
from .test_by_hand import FIRST_ROW, VARY
from .test_rows_by_hand import EVALUATE

STUDY = "gelsight-mini-ideal-search-2"
"""Where the second search of the design is kept, beside its folder."""

FILE = "[uU]ntitled.blend"
"""Where Blender keeps the scene: the name that it proposes, since Blender 5 with a capital."""

GHOSTS = "[e.name for e in kinds('SHOWN') if e.optisense.key.startswith('ghost ')]"
TOLD = "manager.optisense_found"
OPTIMISE = 6
"""The panel's place in the sidebar; the first is 0."""

A_GHOST, NO_GHOST = 10_000, 2_000
"""Pixels of the view that a ghost covers at least, and at most as many that have its colour without
one: there are 972 where the beams of a blue and a green lamp overlap."""

MANY, TRIALS = 5000, 150
"""Trials of a search that is given up, and of one that is not over before Blender is closed."""

SLOW = """
import time

def height(evaluation):
    '''How high the gel is; takes two seconds, so that each stage lasts.'''
    time.sleep(2.0)
    return float(evaluation.design.deformed_meshes()["gel"].vertices[:, 2].mean())
"""
"""An objective of a user's own."""

RAYS = "any(each.optisense.key == 'ray hit' for each in scene().objects)"
SELECTED = "[each.name for each in scene().objects if each.select_get()]"
VIEW = "[list(row) for row in area('VIEW_3D').spaces.active.region_3d.view_matrix]"

RANGE = "cages.skin.points[14].z=2:12"
"""Range of the height of the middle of the skin."""

POINTS = "part('scene.cages').shown_points(kinds('CAGE')[0])"


def finished(study: Path) -> dict[int, Any]:
    """When each trial was finished, by its number; 0 is the start."""
    with sqlite3.connect(study / "trials.sqlite") as database:
        return dict(database.execute("select number, finished from trials where done = 1"))


def ghost_pixels(bench: Bench) -> int:
    """How much of the view has the colour of a ghost before a grey or brown ground."""
    red, green, blue = np.moveaxis(bench.view(), 2, 0)
    return int(np.count_nonzero((green - red > 25) & (blue - red > 25) & (blue - green < 25)))


def test_a_mini_is_saved(bench: Bench) -> None:
    bench.greet()
    bench.open_tab()
    bench.new_sensor("gelsight-mini-ideal")
    bench.press("optisense.save_as", across=0.85)
    bench.choose_file()
    bench.until("scene().optisense.is_saved")
    bench.rest()


def test_what_may_vary_is_chosen(bench: Bench) -> None:
    bench.press("optisense.select_cage")
    bench.until("bpy.context.view_layer.objects.active.optisense.kind == 'CAGE'")
    labels = bench.see(
        "[e.label for e in part('core.search_parameters').for_cage('skin', (), blended=False)]"
    )
    bench.only(OPTIMISE)
    bench.choose(bench.find(VARY), labels.index("skin: all points in z"))
    bench.until("len(scene().optisense_search.vary) == 1")
    x, y = bench.find(VARY)
    bench.enter_at((x, y + FIRST_ROW), RANGE, times=2)
    bench.until(f"scene().optisense_search.vary[0].text == {RANGE!r}")
    bench.enter("method", "random")
    bench.enter("budget", str(MANY))
    bench.until(f"scene().optisense_search.budget == {MANY}")


def test_the_best_so_far_is_a_ghost_until_the_search_is_given_up(bench: Bench) -> None:
    bench.press("optisense.search", across=0.25)
    bench.until("state().busy == 'Searching'")
    bench.until(GHOSTS)
    assert ghost_pixels(bench) > A_GHOST
    bench.photograph("ghost")
    bench.press("optisense.cancel", across=0.9)
    bench.until("not state().busy")
    assert bench.see(f"{TOLD}.ended").endswith("stopped")
    assert not bench.see(GHOSTS) and ghost_pixels(bench) < NO_GHOST
    bench.bring("optisense.apply_best", 0.9, across=0.25)
    bench.photograph("given-up")


def test_blender_is_closed_during_a_search(bench: Bench) -> None:
    bench.over_view()
    bench.desktop.keys("ctrl+s")
    bench.choose_file()
    bench.until("bpy.data.filepath and not bpy.data.is_dirty")
    (file,) = bench.home.glob(FILE)
    saved = file.stat().st_mtime_ns
    bench.enter("budget", str(TRIALS))
    bench.press("optisense.search", across=0.25)
    bench.until("state().busy == 'Searching'")
    bench.until(GHOSTS)
    assert bench.see("bpy.data.is_dirty"), "else it would be closed without the study's name"
    bench.quit()
    assert file.stat().st_mtime_ns > saved, "Blender asked, and saved it again"
    assert 1 < len(finished(bench.home / STUDY)) < TRIALS


def test_it_is_offered_and_goes_on_by_one_click(bench: Bench) -> None:
    before = finished(bench.home / STUDY)
    bench.start(*bench.home.glob(FILE))
    bench.until(f"{TOLD}.offer")
    assert f"{STUDY} is not finished" in bench.see(f"{TOLD}.offer")
    assert not bench.see(GHOSTS)
    bench.bring("optisense.apply_best", 0.9, across=0.25)
    bench.photograph("offered")
    bench.press("optisense.resume", across=0.75)
    bench.until("state().busy == 'Searching'")
    bench.until(GHOSTS)
    bench.rest()
    assert bench.see(f"{TOLD}.ended").startswith(f"{TRIALS} trials")
    after = finished(bench.home / STUDY)
    assert sorted(after) == list(range(TRIALS + 1)), "the start, and as many as were asked for"
    assert {number: after[number] for number in before} == before, "none was done again"
    bench.photograph("gone-on")


def test_the_best_is_kept_as_a_variant(bench: Bench) -> None:
    bench.press("optisense.keep_variant", across=0.75)
    bench.choose_file()
    bench.until("'Written to' in state().note")
    bench.photograph("kept")
    kept = yaml.safe_load((bench.home / f"{STUDY}-best" / "design.yaml").read_text())
    own = yaml.safe_load((bench.home / "gelsight-mini-ideal" / "design.yaml").read_text())
    height = kept["cages"]["skin"]["points"][14]["z"]
    assert own["cages"]["skin"]["points"][14]["z"] == 0.0
    assert f"= {height:.4g}" in bench.see(f"{TOLD}.values")
    assert bench.see(GHOSTS), "it is not in the scene yet"


def test_the_ghost_becomes_the_sensor_and_all_else_stays(bench: Bench) -> None:
    bench.only(EVALUATE)
    bench.press("optisense.show_rays", across=0.25)
    bench.until(RAYS)
    bench.rest()
    camera = bench.see("kinds('CAMERA')[0].name")
    bench.desktop.click(*bench.see(f"on_screen(bpy.data.objects[{camera!r}].matrix_world"
                                   ".translation)"))  # fmt: skip
    bench.until(f"{SELECTED} == [{camera!r}]")
    bench.over_view()
    before = bench.see(VIEW)
    bench.desktop.keys("KP_6")  # turns the view a little
    bench.until(f"{VIEW} != {before!r}")
    bench.drawn()
    view = bench.see(VIEW)
    while (now := bench.see(VIEW)) != view:  # it turns smoothly
        view = now
    bench.only(OPTIMISE)
    bench.press("optisense.apply_best", across=0.25)
    bench.until(f"not state().busy and float({POINTS}[14][2]) > 1.0")
    bench.rest()
    height = bench.see(f"float({POINTS}[14][2])")
    skin = bench.see("max(v.co.z for v in bpy.data.objects['skin'].data.vertices)")
    assert skin == pytest.approx(height / 4, abs=1e-4), "the weight of that point in its middle"
    assert not bench.see(GHOSTS)
    assert np.allclose(bench.see(VIEW), view, atol=1e-4), "the view stays where it was"
    assert bench.see(SELECTED) == [camera]
    bench.until(RAYS)
    bench.photograph("applied")


def test_what_a_search_does_before_and_after_its_trials_is_said(bench: Bench) -> None:
    goal = bench.home / "goal.py"
    goal.write_text(SLOW)
    bench.enter("objective", f"{goal}:height")
    bench.enter("budget", "2")
    bench.press("optisense.search", across=0.25)
    for text in ("scoring this sensor", " of 2 trials", "scoring the best again"):
        bench.until(f"{text!r} in state().progress")
        bench.photograph(f"search-{text.split()[0]}-{text.split()[-1]}")
    bench.rest()
    assert bench.see(f"{TOLD}.ended").startswith("2 trials")
