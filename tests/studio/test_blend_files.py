"""Blender files that are opened while something is going on, and after it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy
import pytest
from waiting import until

from studio.engine import session
from studio.sensor.opening import open_source
from studio.simulate import drafts


@pytest.fixture
def another(mini: Any, tmp_path: Path) -> Callable[[], Any]:
    """Opens a .blend file with a sensor called 'another'; gives its scene."""
    file = str(tmp_path / "another.blend")
    title = mini.optisense.title
    mini.optisense.title = "another"
    bpy.ops.wm.save_as_mainfile(filepath=file, copy=True)
    mini.optisense.title = title

    def opened() -> Any:
        bpy.ops.wm.open_mainfile(filepath=file)
        return bpy.context.scene

    return opened


def settled() -> None:
    """All that was asked of the engine is answered."""
    engine = session.engine()
    until(lambda: not engine.waiting, problem_allowed=True)


def test_a_sensor_on_its_way_does_not_arrive_in_another_file(
    mini: Any, another: Callable[[], Any]
) -> None:
    assert open_source(mini, "builtin:gelsight-svelte", "", wait=False)
    scene = another()
    assert not session.is_busy() and not session.state().busy
    settled()
    assert scene.optisense.title == "another"


def test_pictures_on_their_way_are_not_shown_in_another_file(
    mini: Any, another: Callable[[], Any]
) -> None:
    mini.optisense_simulation.size, mini.optisense_simulation.noise = "160", 50.0
    assert bpy.ops.optisense.simulate(wait=False) == {"FINISHED"}
    another()
    settled()
    assert not bpy.context.window_manager.optisense_picture.shown
    bpy.context.scene.optisense_simulation.draft = True
    drafts._ask()
    assert session.engine().waiting
    another()
    settled()
    assert not bpy.context.window_manager.optisense_picture.shown


def test_the_picture_of_another_file_says_so_and_is_not_relit(
    mini: Any, another: Callable[[], Any]
) -> None:
    mini.optisense_simulation.size, mini.optisense_simulation.noise = "160", 50.0
    assert bpy.ops.optisense.simulate() == {"FINISHED"}
    another()
    now = bpy.context.window_manager.optisense_picture
    assert not now.image and now.is_before == now.shown
    assert not bpy.ops.optisense.report.poll()
