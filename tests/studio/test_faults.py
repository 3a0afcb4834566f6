"""Scenes that are no design: what is wrong is selected and named."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy
import numpy as np
import pytest

from studio.engine import session
from studio.scene.collections import object_of, objects_of
from studio.scene.gather import gather


def part(name: str) -> Any:
    return object_of(bpy.context.scene, "PART", name)


def first(kind: str) -> Any:
    return objects_of(bpy.context.scene, kind)[0]


def copy(item: Any) -> None:
    for each in bpy.context.scene.objects:
        each.select_set(each == item)
    bpy.ops.object.duplicate()


def copy_cage() -> None:
    bpy.ops.optisense.select_cage(cage=first("CAGE").optisense.key)
    bpy.ops.object.duplicate()


def lose_a_point() -> None:
    points = [vertex.co[:] for vertex in first("CAGE").data.vertices]
    first("CAGE").data.clear_geometry()
    first("CAGE").data.from_pydata(points[1:], [], [])


@pytest.mark.parametrize(
    ("spoil", "words", "selected"),
    [
        (lambda: part("gel").data.clear_geometry(), "'gel': the mesh file has no", ["gel"]),
        (lambda: setattr(first("CAMERA").optisense, "fov", 200.0), "180 degrees", ["camera"]),
        (lose_a_point, "26 control points", ["cage skin"]),
        (copy_cage, "Two cages", ["cage skin", "cage skin.001"]),
        (lambda: copy(first("CAMERA")), "2 cameras", ["camera", "camera.001"]),
        (lambda: setattr(first("LIGHT").optisense, "group", "gone"), "group 'gone'", ["red"]),
        (
            lambda: setattr(objects_of(bpy.context.scene, "LIGHT")[1], "scale", (0, 0, 0)),
            "scaled to nothing",
            ["red.001"],
        ),
        (lambda: setattr(first("CAMERA").location, "x", float("nan")), "nowhere", ["camera"]),
    ],
    ids=[
        "empty mesh",
        "field of view",
        "lost point",
        "two cages",
        "two cameras",
        "no group",
        "no size",
        "no place",
    ],
)
def test_what_is_wrong_is_selected_and_named(
    spoil: Callable[[], Any], words: str, selected: list[str], mini: Any
) -> None:
    spoil()
    for run in (bpy.ops.optisense.check, bpy.ops.optisense.simulate):
        try:
            run()
        except RuntimeError as error:
            assert words in str(error)
        assert words in session.state().problem
        assert sorted(each.name for each in bpy.context.selected_objects) == selected
        assert all(name in session.state().hint for name in selected)


def test_what_is_wrong_is_shown_where_it_was_hidden(mini: Any) -> None:
    gel = part("gel")
    gel.optisense.material = ""
    gel.hide_set(True)
    bpy.context.view_layer.layer_collection.children["Contacts"].exclude = True
    bpy.ops.optisense.add_contact()  # it is not in the view, and can't be deselected either
    bpy.ops.optisense.check()
    assert list(bpy.context.selected_objects) == [gel]
    bpy.context.view_layer.layer_collection.children["OpticalSystem"].exclude = True
    bpy.ops.optisense.check()
    assert "Hidden with its collection: gel" in session.state().hint


def test_a_part_whose_cage_was_deleted_can_be_moved(mini: Any) -> None:
    assert all(part("gel").lock_location)
    copy(part("gel"))
    bpy.context.view_layer.update()
    (copied,) = bpy.context.selected_objects
    assert not any(copied.lock_location) and all(part("gel").lock_location)
    bpy.ops.optisense.select_cage(cage=first("CAGE").optisense.key)
    bpy.ops.object.delete()
    bpy.context.view_layer.update()
    assert not any(part("gel").lock_location) and not any(part("gel").lock_scale)


def test_a_mirrored_part_keeps_its_outside(mini: Any, select: Callable[..., None]) -> None:
    select(first("CAGE"))
    bpy.ops.optisense.remove_cage()
    for name in ("skin", "gel"):
        part(name).scale = (-1.0, 1.0, 1.0)
    bpy.ops.optisense.check()
    assert not session.state().problem


def test_modifiers_of_a_part_count(mini: Any) -> None:
    tray = part("tray")
    before = gather(mini)[1]["tray"]
    shift = tray.modifiers.new("Shift", "DISPLACE")
    shift.direction, shift.strength, shift.mid_level = "Z", -0.5, 0.0
    after = gather(mini)[1]["tray"]
    assert np.allclose(after.vertices, before.vertices - [0.0, 0.0, 0.5], atol=1e-5)
    assert np.array_equal(after.faces, before.faces)
