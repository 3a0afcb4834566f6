"""What a designer meets at every step: pictures that stay, groups that select, errors that go."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy
import numpy as np
import pytest
from recording import draw
from shown_picture import shown
from waiting import until

from studio.core.engine import EngineError
from studio.engine import session
from studio.lights.group_selection import _follow
from studio.scene import selection_state
from studio.scene.build import build
from studio.scene.collections import object_of, objects_of
from studio.simulate import drafts, picture
from studio.simulate.exposure import resolution


def small(scene: Any) -> None:
    scene.optisense_simulation.size, scene.optisense_simulation.noise = "320", 50.0


def test_a_draft_takes_the_place_of_the_picture_whole(mini: Any) -> None:
    small(mini)
    assert bpy.ops.optisense.simulate() == {"FINISHED"}
    told: list[str] = []
    picture.when_resized.append(told.append)
    try:
        mini.optisense_simulation.draft = True
        drafts._soon()
        until(lambda: bpy.context.window_manager.optisense_picture.is_draft)
    finally:
        picture.when_resized.remove(told.append)
        mini.optisense_simulation.draft = False
    whole = shown()
    assert whole.shape == (240, 320, 4) and not told
    assert np.array_equal(whole[::2, ::2], whole[1::2, 1::2]), "each pixel of the draft four times"
    assert bpy.context.window_manager.optisense_picture.summary.startswith("160 x 120")


@pytest.mark.parametrize("size", [(320, 240), (250, 77)])
def test_an_enlarged_picture_keeps_its_colours_in_their_places(size: tuple[int, int]) -> None:
    ramp = np.zeros((30, 40, 4), dtype=np.float32)
    ramp[..., 0], ramp[..., 1] = np.linspace(0, 1, 40), np.linspace(0, 1, 30)[:, None]
    large = picture.enlarged(ramp, size)
    assert large.shape == (size[1], size[0], 4)
    assert np.allclose(large[0, :, 0], np.linspace(0, 1, size[0]), atol=1 / 39)
    assert np.allclose(large[:, 0, 1], np.linspace(0, 1, size[1]), atol=1 / 29)
    assert picture.enlarged(ramp, (20, 15)) is ramp, "never smaller"


def test_relighting_never_blows_out_and_automatic_exposure_is_kept(mini: Any) -> None:
    small(mini)
    settings = mini.optisense_simulation
    assert bpy.ops.optisense.simulate() == {"FINISHED"}
    first = settings.exposure
    for group in mini.optisense.light_groups:
        group.flux = 50.0
    assert (shown()[..., :3].min(axis=2) > 0.99).mean() < 0.05
    assert settings.exposure < 0.2 * first
    before = shown()
    settings.auto_exposure = False
    assert np.array_equal(shown(), before), "as bright as it was"
    settings.exposure *= 0.5
    assert shown().mean() < before.mean()


def test_the_longer_side_of_a_picture_is_as_asked(mini: Any) -> None:
    camera = objects_of(mini, "CAMERA")[0].optisense
    mini.optisense_simulation.size = "320"
    camera.pixels = (240, 320)
    assert resolution(mini) == [240, 320]
    camera.pixels = (640, 480)
    assert resolution(mini) == [320, 240]


def test_an_error_goes_with_the_undo_of_what_caused_it(mini: Any) -> None:
    bpy.data.objects.remove(objects_of(mini, "CAMERA")[0])
    bpy.ops.ed.undo_push(message="Delete")
    with pytest.raises(RuntimeError, match="no camera"):
        bpy.ops.optisense.simulate()
    now = session.state()
    assert "no camera" in now.problem and now.about == "Simulating"
    assert "no camera" in " ".join(draw(bpy.types.OPTISENSE_PT_simulate).texts)
    assert "no camera" not in " ".join(draw(bpy.types.OPTISENSE_PT_sensor).texts), "told once"
    bpy.ops.ed.undo()
    assert not now.problem and not now.hint
    assert objects_of(bpy.context.scene, "CAMERA")


def test_a_group_in_the_list_selects_its_lights_and_the_other_way_round(
    mini: Any, select: Callable[..., None]
) -> None:
    design = mini.optisense
    design.light_group_index = design.light_groups.find("green")
    assert {each.optisense.group for each in bpy.context.selected_objects} == {"green"}
    assert len(bpy.context.selected_objects) == 5
    blue = next(each for each in objects_of(mini, "LIGHT") if each.optisense.group == "blue")
    select(blue)
    _follow(mini)
    assert design.light_groups[design.light_group_index].name == "blue"
    assert list(bpy.context.selected_objects) == [blue], "the list follows and selects nothing"


def test_a_row_of_lights_leaves_room_between_them(mini: Any) -> None:
    assert bpy.ops.optisense.add_light(
        model="chanzon-5730", group="NEW", name="row", count=3, place=(0, 0, -8), aim="PLUS_Z"
    ) == {"FINISHED"}
    row = [each for each in objects_of(mini, "LIGHT") if each.optisense.group == "row"]
    places = np.array([each.matrix_world.translation for each in row])
    size = max(session.ask_and_wait("lamp", entry="chanzon-5730")["window"]["size"])
    assert np.linalg.norm(np.diff(places, axis=0), axis=1).min() > size
    assert np.allclose(places.mean(axis=0), (0, 0, -8), atol=1e-4)
    ways = [-each.matrix_world.col[2].to_3d() for each in row]
    assert np.allclose(ways, (0, 0, 1), atol=1e-5)


def test_a_new_camera_is_selected_and_seen_through_the_housing(mini: Any) -> None:
    assert bpy.ops.optisense.add_camera(model="pi-v2") == {"FINISHED"}
    camera = objects_of(mini, "CAMERA")[0]
    assert list(bpy.context.selected_objects) == [camera] and camera.show_in_front


def test_selection_and_what_is_hidden_outlive_a_better_design(
    mini: Any, mini_design: tuple[Any, Any], select: Callable[..., None]
) -> None:
    lights = objects_of(mini, "LIGHT")
    object_of(mini, "PART", "tray").hide_set(True)
    select(lights[7], lights[3])
    was = [(each.optisense.group, each.location.copy()) for each in (lights[7], lights[3])]
    looks = selection_state.looks_of(mini)
    build(mini, *mini_design, keep_others=True)
    selection_state.restore(mini, looks)
    chosen = [(each.optisense.group, each.location) for each in bpy.context.selected_objects]
    assert sorted(chosen, key=str) == sorted(was, key=str)
    active = bpy.context.view_layer.objects.active
    assert (active.optisense.group, active.location) == was[0]
    assert object_of(mini, "PART", "tray").hide_get()
    assert not object_of(mini, "PART", "gel").hide_get()


def test_what_is_said_of_no_job_is_told_by_the_panel_sensor(mini: Any) -> None:
    session.state().about = ""
    session.say(EngineError({"kind": "EngineGone", "message": "the engine is gone"}))
    assert "The engine is gone" in draw(bpy.types.OPTISENSE_PT_sensor).texts
