"""Blender files that are opened while something is going on, and after it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest
from waiting import until

from studio.core.engine import EngineError
from studio.engine import design_transfer, session
from studio.scene.collections import object_of, objects_of
from studio.scene.gather import gather
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


@pytest.mark.parametrize("how", ["objects", "collection", "excluded"])
def test_disabled_objects_keep_their_places(how: str, mini: Any, tmp_path: Path) -> None:
    """Blender does not evaluate them: `matrix_world` is the identity after a file was opened."""
    guide, camera = object_of(mini, "PART", "guide"), objects_of(mini, "CAMERA")[0]
    rig = bpy.data.objects.new("rig", None)
    mini.collection.objects.link(rig)
    camera.parent, rig.location.z, guide.location.z = rig, 2.0, -0.5
    before, meshes = gather(mini)
    if how == "objects":
        for each in (guide, camera, rig, *objects_of(mini, "LIGHT")):
            each.hide_viewport = True
    elif how == "collection":
        bpy.data.collections["OpticalSystem"].hide_viewport = True
    else:
        bpy.context.view_layer.layer_collection.children["OpticalSystem"].exclude = True
    file = str(tmp_path / "disabled.blend")
    bpy.ops.wm.save_as_mainfile(filepath=file, copy=True)
    bpy.ops.wm.open_mainfile(filepath=file)
    after, found = gather(bpy.context.scene)
    for name in ("lights", "camera"):
        assert after[name] == before[name]
    assert np.array_equal(found["guide"].vertices, meshes["guide"].vertices)
    objects_of(bpy.context.scene, "LIGHT")[0].location.x += 3.0
    moved = gather(bpy.context.scene)[0]["lights"]["red"]["lights"][0]["position"]
    assert moved[0] == pytest.approx(before["lights"]["red"]["lights"][0]["position"][0] + 3.0)


def test_modifiers_of_a_disabled_part_are_not_lost_silently(mini: Any) -> None:
    guide = object_of(mini, "PART", "guide")
    guide.modifiers.new("thick", "DISPLACE")
    guide.hide_viewport = True
    with pytest.raises(EngineError, match="'guide' has modifiers, which Blender does not evaluate"):
        design_transfer.design(mini)
