"""Rows of lights as a whole: pitch, count, length; hidden, or alone."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
import pytest
from shown_picture import shown
from waiting import until

from studio.core import rows
from studio.engine import session
from studio.lights.group_selection import lights_of
from studio.lights.row_gizmo import frame
from studio.looks.drawing import outline
from studio.scene.collections import objects_of, select_only
from studio.scene.gather import gather_document
from studio.scene.lamps import light_pose


def places(scene: Any, group: str = "red") -> np.ndarray:
    bpy.context.view_layer.update()
    return np.array([light_pose(each)["position"] for each in lights_of(scene, group)])


def test_a_row_is_found_and_what_is_none_is_not() -> None:
    way = np.array((0.6, 0.0, 0.8))
    row = rows.row_through([way * each + (1.0, 2.0, 3.0) for each in (0.0, 2.0, 4.0)])
    assert row is not None and row.pitch == pytest.approx(2.0)
    np.testing.assert_allclose(row.along, way, atol=1e-12)
    np.testing.assert_allclose(row.middle, way * 2.0 + (1.0, 2.0, 3.0))
    np.testing.assert_allclose(row.places(2, 3.0), [row.middle - 1.5 * way, row.middle + 1.5 * way])
    assert rows.row_through([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]) is None
    assert rows.row_through([(1, 1, 1), (1, 1, 1)]) is None and rows.row_through([]) is None


def test_count_and_pitch_keep_the_middle_and_the_aim(mini: Any) -> None:
    select_only(*lights_of(mini, "red"))
    before, was = places(mini), gather_document(mini)["lights"]
    directions = {tuple(light_pose(each)["direction"]) for each in lights_of(mini, "red")}
    assert bpy.ops.optisense.arrange_row(count=3, pitch=5.0) == {"FINISHED"}
    after = places(mini)
    assert len(after) == 3
    np.testing.assert_allclose(after.mean(axis=0), before.mean(axis=0), atol=1e-4)
    np.testing.assert_allclose(np.linalg.norm(np.diff(after, axis=0), axis=1), 5.0, atol=1e-4)
    assert {tuple(light_pose(each)["direction"]) for each in lights_of(mini, "red")} <= directions
    now = gather_document(mini)["lights"]
    assert now["green"] == was["green"] and now["red"]["flux"] == was["red"]["flux"]
    assert {each.name for each in bpy.context.selected_objects} == {
        each.name for each in lights_of(mini, "red")
    }


def test_a_length_sets_the_pitch(mini: Any) -> None:
    select_only(*lights_of(mini, "red"))
    assert bpy.ops.optisense.arrange_row(count=5, length=10.0) == {"FINISHED"}
    after = places(mini)
    assert np.linalg.norm(after[-1] - after[0]) == pytest.approx(10.0, abs=1e-4)
    select_only(*objects_of(mini, "LIGHT"))
    with pytest.raises(RuntimeError, match="lights of one row"):
        bpy.ops.optisense.arrange_row(count=2)


def test_a_group_alone_is_what_the_picture_shows(mini: Any) -> None:
    mini.optisense_simulation.size, mini.optisense_simulation.noise = "160", 50.0
    mini.optisense_simulation.auto_exposure = False
    assert bpy.ops.optisense.simulate() == {"FINISHED"}
    was = gather_document(mini)["lights"]

    def mean_colour() -> np.ndarray:
        return shown()[..., :3].mean(axis=(0, 1))

    whole = mean_colour()
    assert bpy.ops.optisense.solo_group(group="red") == {"FINISHED"}
    red = mean_colour()
    assert red[0] > 0.5 * whole[0] and red[1] < 0.5 * whole[1] and red[2] < 0.5 * whole[2]
    assert all(each.hide_get() == (each.optisense.group != "red")
               for each in objects_of(mini, "LIGHT"))  # fmt: skip
    assert gather_document(mini)["lights"] == was  # the design keeps its lights
    assert bpy.ops.optisense.simulate() == {"FINISHED"}
    np.testing.assert_allclose(mean_colour(), red, rtol=0.1, atol=0.01)
    assert bpy.ops.optisense.solo_group(group="red") == {"FINISHED"}
    np.testing.assert_allclose(mean_colour(), whole, rtol=0.1, atol=0.01)
    with pytest.raises(RuntimeError, match="no light group 'pink'"):
        bpy.ops.optisense.solo_group(group="pink")


def test_the_nearest_edge_is_met_where_it_is_nearest_and_runs_with_the_row() -> None:
    row = rows.row_through([(-2.0, 1.0, 0.5), (0.0, 1.0, 0.5), (2.0, 1.0, 0.5)])
    edges = np.array([
        [(5.0, 0.0, 0.0), (-5.0, 0.0, 0.0)],  # below the row, and against it
        [(0.0, 9.0, 0.0), (0.0, 9.0, 0.0)],  # of no length
        [(0.0, 7.0, 0.0), (0.0, 9.0, 0.0)],
    ])  # fmt: skip
    place, along = rows.nearest_edge(row, edges)
    assert place == pytest.approx((0.0, 0.0, 0.0)) and along == pytest.approx((1.0, 0.0, 0.0))
    corner = np.array([[(0.0, 0.0, 0.0), (0.0, 0.0, 9.0)], [(0.0, 0.0, 0.0), (3.0, 0.0, 0.0)]])
    far = rows.row_through([(-9.0, -1.0, -1.0), (-5.0, -1.0, -1.0)])
    assert rows.nearest_edge(far, corner)[1] == pytest.approx((1.0, 0.0, 0.0))
    assert rows.nearest_edge(row, edges[1:2]) is None


def test_a_row_is_snapped_to_an_edge_of_the_gel(mini: Any) -> None:
    lights = lights_of(mini, mini.optisense.light_groups[0].name)
    select_only(*lights)
    before = [light_pose(each) for each in lights]
    assert bpy.ops.optisense.snap_row() == {"FINISHED"}
    bpy.context.view_layer.update()
    after = [light_pose(each) for each in lights]
    places = np.array([pose["position"] for pose in after])
    shifts = np.linalg.norm(np.diff(places, axis=0), axis=1)
    was = np.linalg.norm(np.diff([pose["position"] for pose in before], axis=0), axis=1)
    assert shifts == pytest.approx(was, abs=1e-4), "the pitch stays"
    ends = np.concatenate([outline(each) for each in objects_of(mini, "PART")]).reshape(-1, 2, 3)
    middle = places.mean(axis=0)
    ways = ends[:, 1] - ends[:, 0]
    share = ((middle - ends[:, 0]) * ways).sum(axis=1) / (ways**2).sum(axis=1)
    near = ends[:, 0] + np.clip(share, 0, 1)[:, None] * ways
    assert np.linalg.norm(near - middle, axis=1).min() < 1e-3


def test_moves_are_caught_by_edges_and_free_again(mini: Any) -> None:
    bpy.ops.optisense.snap_moves()
    assert mini.tool_settings.use_snap and "EDGE" in mini.tool_settings.snap_elements
    bpy.ops.optisense.snap_moves()
    assert not mini.tool_settings.use_snap


def test_the_frame_of_a_row_follows_it_and_its_light(mini: Any) -> None:
    lights = lights_of(mini, mini.optisense.light_groups[0].name)
    found = np.array(frame(lights))
    pose, last = light_pose(lights[0]), light_pose(lights[-1])
    along = np.subtract(last["position"], pose["position"])
    assert abs(found[:3, 0] @ along) == pytest.approx(np.linalg.norm(along), rel=1e-3)
    assert found[:3, 2] == pytest.approx(-np.array(pose["direction"]), abs=1e-3)
    assert np.linalg.det(found[:3, :3]) == pytest.approx(1.0, abs=1e-5)


def test_lamps_keep_their_size_when_the_step_after_opening_is_undone(scene: Any) -> None:
    def red() -> Any:
        bpy.context.view_layer.update()
        return lights_of(bpy.context.scene, "red")[0]

    def are_drawn() -> bool:
        return all(each.drawn for each in bpy.context.scene.optisense.light_groups)

    assert bpy.ops.optisense.new(sensor="gelsight-mini") == {"FINISHED"}
    until(are_drawn)
    size = tuple(red().dimensions)
    red().location.x += 1.0
    bpy.ops.ed.undo_push(message="Move")
    bpy.ops.ed.undo()
    assert are_drawn() and not session.engine().waiting, "the answer before is remembered"
    assert tuple(red().dimensions) == size and size[0] > 1.0
