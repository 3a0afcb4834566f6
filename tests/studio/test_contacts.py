"""Contacts: they press as they are drawn; what is wrong with one selects and names it."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import bpy
import numpy as np
import pytest
from mathutils import Vector

from studio.core.engine import EngineError
from studio.engine import design_transfer, session
from studio.scene.collections import object_of, objects_of
from studio.scene.lamps import redraw
from studio.simulate.operator import press_along


def small(scene: Any) -> None:
    scene.optisense_simulation.size = "160"
    scene.optisense_simulation.noise = 50.0


def test_a_contact_that_is_too_deep_is_selected_and_named(
    mini: Any, select: Callable[..., None]
) -> None:
    small(mini)
    for _ in range(3):
        bpy.ops.optisense.add_contact()
    first, hidden, deep = objects_of(mini, "CONTACT")
    hidden.hide_set(True)  # does not press, and is not counted
    deep.optisense.depth = 40.0
    select(first)
    with pytest.raises(RuntimeError, match="mm thick"):
        bpy.ops.optisense.simulate()
    assert list(bpy.context.selected_objects) == [deep]
    assert bpy.context.active_object == deep
    assert f"Selected: {deep.name}" in session.state().hint


def test_a_contact_off_the_surface_is_selected(mini: Any) -> None:
    small(mini)
    for _ in range(2):
        bpy.ops.optisense.add_contact()
    off = objects_of(mini, "CONTACT")[1]
    off.constraints.clear()  # else it would be held on the surface
    off.location = (0.0, 0.0, 30.0)
    with pytest.raises(RuntimeError, match="away from the sensing surface"):
        bpy.ops.optisense.simulate()
    assert list(bpy.context.selected_objects) == [off]


def test_a_contact_that_the_camera_does_not_see_is_selected_and_said(mini: Any) -> None:
    small(mini)
    for _ in range(2):
        bpy.ops.optisense.add_contact()
    corner = objects_of(mini, "CONTACT")[0]
    corner.location = (8.3, 10.0, 0.0)
    corner.optisense.radius = 0.5
    assert bpy.ops.optisense.simulate() == {"FINISHED"}
    assert list(bpy.context.selected_objects) == [corner]
    assert f"does not see {corner.name}" in session.state().note
    corner.location = (4.0, 3.0, 0.0)
    assert bpy.ops.optisense.simulate() == {"FINISHED"}
    assert "does not see" not in session.state().note


def test_a_contact_on_a_gel_that_is_gone(mini: Any) -> None:
    small(mini)
    bpy.ops.optisense.add_contact()
    bpy.data.objects.remove(object_of(mini, "PART", "skin"))
    with pytest.raises(RuntimeError):
        bpy.ops.optisense.simulate()
    assert session.state().problem


def test_only_what_counts_can_be_changed_by_hand(mini: Any) -> None:
    bpy.ops.optisense.add_contact()
    for kind in ("CONTACT", "LIGHT", "CAMERA"):
        assert all(objects_of(mini, kind)[0].lock_scale), kind


def test_nine_contacts_are_like_the_active_one(mini: Any, select: Callable[..., None]) -> None:
    bpy.ops.optisense.add_contact()
    values = bpy.context.active_object.optisense
    values.indenter, values.length, values.depth, values.rotation = "cylinder", 4.0, 0.25, 30.0
    assert bpy.ops.optisense.nine_contacts() == {"FINISHED"}
    nine = [each.optisense for each in objects_of(mini, "CONTACT")]
    assert len(nine) == 9 and {each.indenter for each in nine} == {"cylinder"}
    assert {(each.length, each.depth, each.rotation) for each in nine} == {(4.0, 0.25, 30.0)}
    select(object_of(mini, "PART", "gel"))
    assert bpy.ops.optisense.nine_contacts() == {"FINISHED"}
    assert {each.optisense.indenter for each in objects_of(mini, "CONTACT")} == {"sphere"}


def disabled(skin: Any) -> None:
    skin.hide_viewport = True


def excluded(skin: Any) -> None:
    layer = bpy.context.view_layer.layer_collection
    layer.children[skin.users_collection[0].name].exclude = True


@pytest.mark.parametrize("hide", [disabled, excluded])
def test_contacts_are_placed_on_a_skin_that_blender_does_not_evaluate(
    hide: Callable[[Any], None], mini: Any, select: Callable[..., None]
) -> None:
    bpy.ops.mesh.primitive_uv_sphere_add(radius=2.0)
    ball = bpy.context.active_object
    hide(object_of(mini, "PART", "skin"))
    bpy.context.view_layer.update()
    assert bpy.ops.optisense.add_contact() == {"FINISHED"}
    assert press_along(bpy.context, Vector((3.0, 2.0, 20.0)), Vector((0.0, 0.0, -1.0)))
    select(ball)
    assert bpy.ops.optisense.set_reference(reference="indenter") == {"FINISHED"}
    found = objects_of(mini, "CONTACT")
    places = [each.location for each in found]
    assert np.allclose(places, [(0, 0, 0), (3, 2, 0), (0, 0, 0)], atol=1e-5)
    assert all(each.matrix_world.col[2].z == pytest.approx(1.0) for each in found)
    assert bpy.ops.optisense.nine_contacts() == {"FINISHED"}
    assert len(objects_of(mini, "CONTACT")) == 9


@pytest.mark.parametrize("sensor", ["gelsight-mini-ideal-spherical", "gelsight-svelte"])
def test_an_indenter_lies_as_it_is_drawn(sensor: str, scene: Any) -> None:
    assert bpy.ops.optisense.new(sensor=sensor) == {"FINISHED"}
    assert bpy.ops.optisense.nine_contacts() == {"FINISHED"}
    for contact in objects_of(scene, "CONTACT"):
        contact.optisense.indenter, contact.optisense.rotation = "cylinder", 20.0
    bpy.context.view_layer.update()
    placed = session.ask_and_wait(
        "place", design=design_transfer.design(scene), contacts=design_transfer.contacts(scene)
    )["contacts"]
    depsgraph = bpy.context.evaluated_depsgraph_get()
    for contact, row in zip(objects_of(scene, "CONTACT"), placed, strict=True):
        pose = contact.evaluated_get(depsgraph).matrix_world
        drawn = np.array([pose @ vertex.co for vertex in contact.data.vertices])
        pressed = np.load(row["mesh"]["vertices"])
        assert abs(long_axis(drawn) @ long_axis(pressed)) > 0.99


def test_a_tilted_plate_lies_as_it_is_drawn(mini: Any) -> None:
    bpy.ops.optisense.add_contact()
    contact = objects_of(mini, "CONTACT")[0]
    contact.optisense.tilt, contact.optisense.rotation = (12.0, 25.0), 35.0
    contact.optisense.indenter = "plane"
    bpy.context.view_layer.update()
    (placed,) = session.ask_and_wait(
        "place", design=design_transfer.design(mini), contacts=design_transfer.contacts(mini)
    )["contacts"]
    pressed = np.load(placed["mesh"]["vertices"])
    depsgraph = bpy.context.evaluated_depsgraph_get()
    pose = contact.evaluated_get(depsgraph).matrix_world
    for vertex in contact.data.vertices:
        assert np.linalg.norm(pressed - np.array(pose @ vertex.co), axis=1).min() < 1e-4


def long_axis(points: np.ndarray) -> np.ndarray:
    """(3,) the direction in which points (n, 3) spread most."""
    return np.linalg.svd(points - points.mean(axis=0), full_matrices=False)[2][0]


def test_a_contact_without_its_file_is_named(mini: Any) -> None:
    bpy.ops.optisense.add_contact()
    bpy.ops.optisense.add_contact()
    contact = objects_of(mini, "CONTACT")[1]
    contact.optisense.indenter = "mesh"
    with pytest.raises(EngineError, match="presses with the mesh of a file") as caught:
        design_transfer.contacts(mini)
    assert caught.value.contact == 1
    with pytest.raises(RuntimeError, match="Choose the file of the indenter under Mesh"):
        bpy.ops.optisense.simulate()
    assert contact.select_get()


@pytest.mark.parametrize("way", ["button", "key"])
def test_the_error_of_a_contact_leaves_with_it(
    way: str, mini: Any, select: Callable[..., None]
) -> None:
    small(mini)
    bpy.ops.optisense.add_contact()
    contact = objects_of(mini, "CONTACT")[0]
    contact.optisense.indenter = "mesh"
    with pytest.raises(RuntimeError):
        bpy.ops.optisense.simulate()
    assert "Selected: contact" in session.state().hint
    bpy.context.view_layer.update()
    assert session.state().problem
    if way == "button":
        bpy.ops.optisense.clear_contacts()
    else:
        select(contact)
        bpy.ops.object.delete()
    bpy.context.view_layer.update()
    assert not session.state().problem and not session.state().hint


def test_a_refusal_takes_the_place_of_the_error_before(mini: Any) -> None:
    session.state().problem = "An error"
    with pytest.raises(RuntimeError, match="There is no objective"):
        bpy.ops.optisense.choose_objective(objective="no-such-one")
    assert not session.state().problem


def scaled(item: Any) -> None:
    item.scale = (3.0, 3.0, 3.0)


def applied(item: Any) -> None:
    item.location = (3.0, 2.0, 0.0)
    bpy.context.view_layer.update()
    bpy.ops.object.transform_apply(location=True, rotation=False, scale=False, isolate_users=True)


@pytest.mark.parametrize("kind", ["CONTACT", "LIGHT"])
@pytest.mark.parametrize("change", [scaled, applied])
def test_what_is_drawn_otherwise_than_it_is_simulated_is_told(
    kind: str, change: Callable[[Any], None], mini: Any, select: Callable[..., None]
) -> None:
    small(mini)
    group = mini.optisense.light_groups[0]
    group.drawn = json.dumps({"window": {"shape": "rectangle", "size": [3.0, 2.0]}})
    redraw(mini, group)
    bpy.ops.optisense.add_contact()
    bpy.ops.optisense.check()
    assert not session.state().problem
    item = objects_of(mini, kind)[0]
    select(item)
    change(item)
    bpy.ops.optisense.check()
    name = f"{kind.capitalize()} '{item.name}' is "
    assert session.state().problem.startswith(name)
    assert f"Selected: {item.name}" in session.state().hint
    if (kind, change) == ("CONTACT", scaled):
        assert bpy.ops.optisense.simulate() == {"FINISHED"}
        assert name in session.state().note
