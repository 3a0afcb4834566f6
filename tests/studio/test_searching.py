"""Searches that are given up, cut short by the end of Blender, and gone on with."""

from __future__ import annotations

import sqlite3
from pathlib import Path
from typing import Any

import bpy
import pytest
from waiting import until

from studio.engine import session
from studio.optimise import search_progress, unfinished_studies
from studio.optimise.operator import TITLE
from studio.scene.collections import objects_of

TRIALS = 12
"""Number of trials of a search that is stopped during its first trials."""

GOAL = """
import time
from pathlib import Path

HOLD = Path(__file__).with_name("hold")

def height(evaluation):
    '''How high the gel is; takes longer while the file `hold` is there, so that it lasts.'''
    if HOLD.exists():
        time.sleep(0.5)
    return float(evaluation.design.deformed_meshes()["gel"].vertices[:, 2].mean())
"""


def found() -> Any:
    return bpy.context.window_manager.optisense_found


def ghosts(scene: Any) -> list[str]:
    return [e.name for e in objects_of(scene, "SHOWN") if e.optisense.key.startswith("ghost ")]


def finished(study: Path) -> dict[int, Any]:
    """When each trial was finished, by its number; 0 is the start."""
    with sqlite3.connect(study / "trials.sqlite") as database:
        return dict(database.execute("select number, finished from trials where done = 1"))


def begin(scene: Any, goal: Path) -> Path:
    """Begin a search of the saved sensor's shape and wait until some of it is done."""
    bpy.ops.optisense.vary(text="cages.skin.points[14].z=1:4", label="height")
    search = scene.optisense_search
    search.objective = f"{goal}:height"
    search.method, search.budget = "random", TRIALS
    assert bpy.ops.optisense.search(wait=False) == {"FINISHED"}
    until(lambda: len(search_progress._curve) >= 2 and ghosts(scene))
    assert session.state().busy == TITLE
    return Path(search.study)


@pytest.fixture
def goal(tmp_path: Path) -> Path:
    """A file with an objective that takes its time."""
    file = tmp_path / "goal.py"
    file.write_text(GOAL)
    file.with_name("hold").touch()
    return file


@pytest.fixture
def saved(mini: Any, tmp_path: Path) -> Any:
    assert bpy.ops.optisense.save_as(filepath=str(tmp_path / "mine")) == {"FINISHED"}
    return mini


def test_the_ghost_of_a_search_goes_when_it_is_given_up(saved: Any, goal: Path) -> None:
    begin(saved, goal)
    assert set(ghosts(saved)) <= {"ghost skin", "ghost gel"}
    bpy.ops.optisense.cancel()
    until(lambda: not session.is_busy())
    assert found().ended.endswith("stopped") and found().best
    assert not ghosts(saved)


def test_a_search_goes_on_after_blender_was_closed(saved: Any, goal: Path, tmp_path: Path) -> None:
    """One .blend file was saved while it ran; one before it began, and so does not name it."""
    earlier, later = (str(tmp_path / f"{name}.blend") for name in ("earlier", "later"))
    bpy.ops.wm.save_as_mainfile(filepath=earlier)
    study = begin(saved, goal)
    bpy.ops.wm.save_as_mainfile(filepath=later, copy=True)
    session.stop()  # as the extension does when Blender ends; the search ends by itself
    before = finished(study)
    assert 1 < len(before) < TRIALS
    goal.with_name("hold").unlink()
    for file in (later, earlier):
        bpy.ops.wm.read_homefile(use_empty=True)
        bpy.ops.wm.open_mainfile(filepath=file)
        scene = bpy.context.scene
        assert (scene.optisense_search.study == str(study)) is (file == later)
        assert not found().offer
        unfinished_studies.offer(scene)
        until(lambda: found().offer)
        assert study.name in found().offer and f"of {TRIALS} trials" in found().offer
        search = scene.optisense_search
        assert (search.study, search.budget, search.method) == (str(study), TRIALS, "random")
        assert len(search_progress._curve) >= len(before) and found().best

    assert bpy.ops.optisense.resume(wait=False) == {"FINISHED"}
    until(lambda: not session.is_busy())
    assert found().ended.startswith(f"{TRIALS} trials") and not found().offer
    after = finished(study)
    assert sorted(after) == list(range(TRIALS + 1)), "the start, and as many as were asked for"
    assert {number: after[number] for number in before} == before, "what was done is not redone"
    assert before.keys() <= search_progress._curve.keys() <= after.keys()

    unfinished_studies.offer(scene)  # it is over: there is nothing to offer
    session.ask_and_wait("study", study=str(study))
    assert not found().offer


def test_a_study_of_another_sensor_is_not_offered(saved: Any, goal: Path) -> None:
    study = begin(saved, goal)
    session.stop()
    saved.optisense.title = "another"
    unfinished_studies.offer(saved)
    session.ask_and_wait("study", study=str(study))
    assert not found().offer and not search_progress.has_trials()
