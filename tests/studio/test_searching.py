"""Searches that are given up, cut short by the end of Blender, and gone on with."""

from __future__ import annotations

import sqlite3
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy
import pytest

from studio.engine import session
from studio.optimise import following, offering
from studio.optimise.operator import TITLE
from studio.scene.collections import objects_of

TRIALS = 150
"""Of a search that is cut short: so many that it is not over when its first ones are told."""


def until(done: Callable[[], Any]) -> None:
    end = time.monotonic() + 300.0
    while not done():
        assert time.monotonic() < end and not session.state().problem, session.state().problem
        time.sleep(session._tick() or 0.0)


def found() -> Any:
    return bpy.context.window_manager.optisense_found


def ghosts(scene: Any) -> list[str]:
    return [e.name for e in objects_of(scene, "SHOWN") if e.optisense.key.startswith("ghost ")]


def finished(study: Path) -> dict[int, Any]:
    """When each trial was finished, by its number; 0 is the start."""
    with sqlite3.connect(study / "trials.sqlite") as database:
        return dict(database.execute("select number, finished from trials where done = 1"))


def begin(scene: Any) -> Path:
    """Begin a search of the saved sensor's shape and wait until some of it is done."""
    bpy.ops.optisense.vary(text="cages.skin.points[14].z=1:4", label="height")
    search = scene.optisense_search
    search.objective, search.method, search.budget = "aoap", "random", TRIALS
    assert bpy.ops.optisense.search(wait=False) == {"FINISHED"}
    until(lambda: len(following._curve) >= 2 and ghosts(scene))
    assert session.state().busy == TITLE
    return Path(search.study)


@pytest.fixture
def saved(mini: Any, tmp_path: Path) -> Any:
    assert bpy.ops.optisense.save_as(filepath=str(tmp_path / "mine")) == {"FINISHED"}
    return mini


def test_the_ghost_of_a_search_goes_when_it_is_given_up(saved: Any) -> None:
    begin(saved)
    assert set(ghosts(saved)) <= {"ghost skin", "ghost gel"}
    bpy.ops.optisense.cancel()
    until(lambda: not session.is_busy())
    assert found().ended.endswith("stopped") and found().best
    assert not ghosts(saved)


@pytest.mark.parametrize("names_study", [True, False])
def test_a_search_goes_on_after_blender_was_closed(
    saved: Any, tmp_path: Path, names_study: bool
) -> None:
    """The .blend file was saved while it ran, or before it began and so does not name it."""
    file = str(tmp_path / "bench.blend")
    bpy.ops.wm.save_as_mainfile(filepath=file)
    study = begin(saved)
    if names_study:
        bpy.ops.wm.save_as_mainfile(filepath=file)
    session.stop()  # as the extension does when Blender ends; the search ends by itself
    before = finished(study)
    assert len(before) > 1
    bpy.ops.wm.read_homefile(use_empty=True)
    bpy.ops.wm.open_mainfile(filepath=file)
    scene = bpy.context.scene
    assert (scene.optisense_search.study == str(study)) is names_study
    offering.offer(scene)
    until(lambda: found().offer)
    assert study.name in found().offer and f"of {TRIALS} trials" in found().offer
    search = scene.optisense_search
    assert (search.study, search.budget, search.method) == (str(study), TRIALS, "random")
    assert len(following._curve) >= len(before) and found().best

    assert bpy.ops.optisense.resume(wait=False) == {"FINISHED"}
    until(lambda: not session.is_busy())
    assert found().ended.startswith(f"{TRIALS} trials") and not found().offer
    after = finished(study)
    assert sorted(after) == list(range(TRIALS + 1)), "the start, and as many as were asked for"
    assert {number: after[number] for number in before} == before, "what was done is not redone"
    assert before.keys() <= following._curve.keys() <= after.keys()

    offering.offer(scene)  # it is over: there is nothing to offer
    session.ask_and_wait("study", study=str(study))
    assert not found().offer


def test_a_study_of_another_sensor_is_not_offered(saved: Any) -> None:
    study = begin(saved)
    session.stop()
    saved.optisense.title = "another"
    offering.offer(saved)
    session.ask_and_wait("study", study=str(study))
    assert not found().offer and not following.has_trials()
