"""Cages: parts follow live, bounds and blends, and the same shape as the engine's."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import bmesh
import bpy
import numpy as np
import pytest
from recording import draw
from waiting import until

from studio.core import cage as core
from studio.core.mesh_file import Mesh
from studio.engine import design_transfer, session
from studio.scene import cages
from studio.scene.build import add_part
from studio.scene.collections import object_of, objects_of
from studio.scene.gather import gather, gather_document
from studio.shapes.cage_warnings import warnings_of
from studio.shapes.ui import OPTISENSE_PT_shapes


def heights(name: str) -> Any:
    part = object_of(bpy.context.scene, "PART", name)
    return cages.shown_vertices(part.data)[:, 2]


def lift(cage: Any, by: float) -> None:
    """Move a point of a cage that is being edited."""
    mesh = bmesh.from_edit_mesh(cage.data)
    mesh.verts.ensure_lookup_table()
    mesh.verts[14].co.z += by
    bmesh.update_edit_mesh(cage.data)


def test_parts_follow_while_points_are_being_edited(mini: Any, select: Callable[..., None]) -> None:
    cage = objects_of(mini, "CAGE")[0]
    select(object_of(mini, "PART", "skin"))
    bpy.ops.optisense.edit_shape()
    assert cage.mode == "EDIT"
    lift(cage, 6.0)
    bpy.context.view_layer.update()
    assert heights("skin").max() == pytest.approx(6.0 / 4, abs=1e-5)  # weight (1/2) (1/2) 1
    bpy.ops.optisense.edit_shape()
    assert cage.mode == "OBJECT"
    point = gather_document(mini)["cages"]["skin"]["points"][14]
    assert point == {"x": 0.0, "y": 0.0, "z": 6.0}


def test_the_shape_is_the_engines(mini: Any) -> None:
    cage = objects_of(mini, "CAGE")[0]
    rng = np.random.default_rng(3)
    shown = cages.shown_points(cage)
    cages.set_points(cage, shown + rng.uniform(-0.4, 0.4, shown.shape))
    cages.follow(mini, cage)
    answer = session.ask_and_wait("open", design=design_transfer.design(mini), name="bent")
    for name in ("skin", "gel"):
        engines = np.load(answer["shapes"][name]["vertices"])
        ours = cages.shown_vertices(object_of(mini, "PART", name).data)
        assert np.allclose(ours, engines, atol=2e-5)


def test_ten_thousand_vertices_follow_a_cage(mini: Any, select: Callable[..., None]) -> None:
    side = np.linspace(-5.0, 5.0, 101)
    x, y = (each.ravel() for each in np.meshgrid(side, side, indexing="ij"))
    vertices = np.stack([x, y, np.zeros_like(x)], axis=1)
    index = np.arange(101 * 101).reshape(101, 101)
    corner = index[:-1, :-1].ravel(), index[1:, :-1].ravel(), index[1:, 1:].ravel()
    faces = np.stack(corner, axis=1).astype(np.int32)
    values = {"role": "mirror", "mesh": "meshes/sheet.obj"}
    sheet = add_part(mini, "sheet", values, Mesh(vertices, faces))
    select(sheet)
    assert bpy.ops.optisense.new_cage(resolution=(3, 3, 3)) == {"FINISHED"}
    cage = bpy.context.active_object
    cages.follow(mini, cage)
    cage.data.vertices[13].co.z = 1.5
    cages.follow(mini, cage)
    bulge = heights("sheet").reshape(101, 101)
    assert bulge[50, 50] == pytest.approx(1.5 / 8, abs=1e-5)  # weight (1/2) (1/2) (1/2)
    assert bulge.max() == bulge[50, 50] and bulge[0, 0] < bulge[20, 20] < bulge[50, 50]
    assert np.allclose(bulge, bulge.T, atol=1e-6) and np.allclose(bulge, bulge[::-1], atol=1e-6)


def test_bounds_and_blend(mini: Any, select: Callable[..., None]) -> None:
    cage = objects_of(mini, "CAGE")[0]
    select(cage)
    with pytest.raises(RuntimeError, match="Set C_min and C_max first"):
        bpy.ops.optisense.blend()
    bpy.ops.optisense.set_bound(bound="c_min")
    cage.data.vertices[14].co.z += 8.0
    cage.data.update()
    bpy.ops.optisense.set_bound(bound="c_max")
    bpy.ops.optisense.blend()
    assert cage.optisense.blend == 1.0, "it starts from the shape that there is"
    assert heights("skin").max() == pytest.approx(8.0 / 4, abs=1e-5)
    cage.optisense.blend = 0.25
    assert heights("skin").max() == pytest.approx(0.25 * 8.0 / 4, abs=1e-5)
    values = gather_document(mini)["cages"]["skin"]
    assert values["blend"] == 0.25 and "points" not in values
    assert values["c_max"][14]["z"] == 8.0
    answer = session.ask_and_wait("check", design=design_transfer.design(mini))
    assert not answer["problems"]
    cage.data.vertices[14].co.z += 1.0  # a hand leaves the blend
    cage.data.update()
    values = gather_document(mini)["cages"]["skin"]
    assert "blend" not in values and values["points"][14]["z"] == pytest.approx(3.0)


def test_bounds_end_editing(mini: Any, select: Callable[..., None]) -> None:
    """Undo in edit mode knows of points only: it would not take bounds and blend back."""
    cage = objects_of(mini, "CAGE")[0]
    select(cage)
    for operator, fields in (
        ("set_bound", {"bound": "c_min"}),
        ("set_bound", {"bound": "c_max"}),
        ("blend", {}),
        ("rest_cage", {}),
    ):
        bpy.ops.optisense.edit_shape()
        assert cage.mode == "EDIT"
        lift(cage, 2.0)
        assert getattr(bpy.ops.optisense, operator)(**fields) == {"FINISHED"}
        assert cage.mode == "OBJECT"
    values = cages.cage_data(cage)
    assert [values[name][14]["z"] for name in ("c_min", "c_max")] == pytest.approx([2.0, 4.0])
    assert heights("skin").max() == pytest.approx(0.0, abs=1e-6)


def test_the_nearest_blend() -> None:
    rng = np.random.default_rng(1)
    lower, upper, aside = rng.normal(size=(3, 27, 3))
    way = upper - lower
    aside -= (aside * way).sum() / (way * way).sum() * way
    for share in (0.0, 0.3, 1.0):
        assert core.nearest_blend(
            core.blended(lower, upper, share) + aside, lower, upper
        ) == pytest.approx(share)
    assert core.nearest_blend(upper + way, lower, upper) == 1.0
    assert core.nearest_blend(lower - way, lower, upper) == 0.0
    assert core.nearest_blend(upper, lower, lower) == 0.0


def test_back_to_rest_and_without_a_cage(mini: Any, select: Callable[..., None]) -> None:
    cage = objects_of(mini, "CAGE")[0]
    cage.data.vertices[14].co.z += 8.0
    cage.data.update()
    cages.follow(mini, cage)
    select(cage)
    bpy.ops.optisense.rest_cage()
    assert heights("skin").max() == pytest.approx(0.0, abs=1e-6)
    bpy.ops.optisense.remove_cage()
    assert gather_document(mini)["cages"] == {}
    select(object_of(mini, "PART", "skin"), object_of(mini, "PART", "gel"))
    assert bpy.ops.optisense.new_cage(resolution=(4, 3, 2)) == {"FINISHED"}
    values = gather_document(mini)["cages"]["skin"]
    assert values["parts"] == ["skin", "gel"] and len(values["points"]) == 24


def told(done: Callable[[str], bool]) -> str:
    """What the panel says, as soon as it says that."""
    texts = ""

    def says_it() -> bool:
        nonlocal texts
        texts = " ".join(draw(OPTISENSE_PT_shapes).texts)
        return done(texts)

    until(says_it)
    return texts


def test_a_cage_that_would_tear_skin_and_gel_apart_is_told_in_the_panel(
    mini: Any, select: Callable[..., None]
) -> None:
    skin, gel = (object_of(mini, "PART", name) for name in ("skin", "gel"))
    select(objects_of(mini, "CAGE")[0])
    bpy.ops.optisense.remove_cage()
    select(skin)
    assert bpy.ops.optisense.new_cage() == {"FINISHED"}
    text = told(lambda text: "tears" in text)
    assert "Put 'gel' into the cage too" in text and "select all of them" in text
    assert warnings_of(mini, "skin")[0]["severity"] == "warning"
    assert not warnings_of(bpy.data.scenes.new("Other"), "skin"), "it has a cage of its own"

    bpy.ops.optisense.edit_shape()
    lift(objects_of(mini, "CAGE")[0], 2.0)
    bpy.context.view_layer.update()
    text = told(lambda text: "has come off" in text)
    assert "part 'gel'" in text and "Put 'gel' into the cage too" in text and "tears" not in text
    bpy.ops.optisense.edit_shape()

    bpy.ops.optisense.remove_cage()
    select(skin, gel)
    assert bpy.ops.optisense.new_cage() == {"FINISHED"}
    told(lambda text: "gel" in text and "Put" not in text and "select all" not in text)


def test_a_lost_control_point_is_told(mini: Any) -> None:
    cage = objects_of(mini, "CAGE")[0]
    mesh = bmesh.new()
    mesh.from_mesh(cage.data)
    mesh.verts.ensure_lookup_table()
    mesh.verts.remove(mesh.verts[5])
    mesh.to_mesh(cage.data)
    mesh.free()
    with pytest.raises(ValueError, match="26 control points instead of 27"):
        gather_document(mini)
    assert json.loads(cage.optisense.data)["resolution"] == [3, 3, 3]


def edited(part: Any) -> None:
    """Its lowest vertices lie 2 mm lower."""
    lowest = min(vertex.co.z for vertex in part.data.vertices)
    for vertex in part.data.vertices:
        vertex.co.z -= 2.0 * (vertex.co.z < lowest + 1e-3)
    part.data.update()


def modified(part: Any) -> None:
    part.modifiers.new("cut", "TRIANGULATE")
    lower = part.modifiers.new("lower", "DISPLACE")
    lower.direction, lower.strength, lower.mid_level = "Z", -1.0, 0.0


def moved(part: Any) -> None:
    rig = bpy.data.objects.new("rig", None)
    bpy.context.scene.collection.objects.link(rig)
    part.parent, part.location.z, part.scale.z, rig.location.x = rig, -3.0, 0.5, 1.0


@pytest.mark.parametrize("change", [edited, modified, moved])
def test_a_new_cage_keeps_the_present_shape_of_its_part(
    change: Callable[[Any], None], mini: Any, select: Callable[..., None]
) -> None:
    guide, light = object_of(mini, "PART", "guide"), objects_of(mini, "LIGHT")[0]
    change(guide)
    light.parent = guide
    before, meshes = gather(mini)
    select(guide)
    assert bpy.ops.optisense.new_cage() == {"FINISHED"}
    after, found = gather(mini)
    assert np.allclose(found["guide"].vertices, meshes["guide"].vertices, atol=1e-6)
    assert np.allclose(
        after["lights"]["red"]["lights"][0]["position"],
        before["lights"]["red"]["lights"][0]["position"],
        atol=1e-5,
    )
    cage = object_of(mini, "CAGE", "guide")
    cage.data.vertices[0].co.z -= 4.0
    cage.data.update()
    bpy.context.view_layer.update()
    answer = session.ask_and_wait("open", design=design_transfer.design(mini), name="bent")
    engines = np.load(answer["shapes"]["guide"]["vertices"])
    shown = [guide.matrix_world @ vertex.co for vertex in guide.data.vertices]
    assert np.allclose(shown, engines, atol=2e-5)
    select(cage)
    bpy.ops.optisense.remove_cage()
    assert np.allclose(gather(mini)[1]["guide"].vertices, meshes["guide"].vertices, atol=1e-6)


@pytest.mark.parametrize("change", [edited, modified])
def test_edits_of_a_part_in_a_cage_are_told(
    change: Callable[[Any], None], mini: Any, select: Callable[..., None]
) -> None:
    gel, cage = object_of(mini, "PART", "gel"), objects_of(mini, "CAGE")[0]
    cage.data.vertices[14].co.z += 4.0
    cage.data.update()
    bpy.context.view_layer.update()
    select(gel)
    assert "ignores" not in " ".join(draw(OPTISENSE_PT_shapes).texts)
    change(gel)
    text = "art 'gel' was edited by hand, or has modifiers; its cage ignores that"
    assert text in " ".join(draw(OPTISENSE_PT_shapes).texts)
    assert bpy.ops.optisense.check() == {"FINISHED"}
    assert text in session.state().problem
    assert "Selected: gel" in session.state().hint


@pytest.mark.parametrize("kind", ["PART", "CAGE"])
def test_a_part_that_was_scaled_in_its_cage_is_told(
    kind: str, mini: Any, select: Callable[..., None]
) -> None:
    item = object_of(mini, kind, "skin")
    select(item)
    assert "scaled" not in " ".join(draw(OPTISENSE_PT_shapes).texts)
    rig = bpy.data.objects.new("rig", None)
    mini.collection.objects.link(rig)
    item.parent, rig.scale = rig, (0.9, 0.9, 1.0)
    bpy.context.view_layer.update()
    text = f"{kind.lower()} 'skin' was moved, turned or scaled"
    assert text in " ".join(draw(OPTISENSE_PT_shapes).texts).lower()
    assert bpy.ops.optisense.check() == {"FINISHED"}
    assert text in session.state().problem.lower()
    assert f"Selected: {item.name}" in session.state().hint


def test_vertices_that_were_added_in_a_cage_are_refused_and_kept_without_it(
    mini: Any, select: Callable[..., None]
) -> None:
    gel = object_of(mini, "PART", "gel")
    before = gather(mini)[1]["gel"].vertices
    select(gel)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.primitive_cube_add(size=1.0, location=(5.0, 5.0, -2.0))
    bpy.ops.object.mode_set(mode="OBJECT")
    text = "art 'gel' got new vertices in its cage"
    assert text in " ".join(draw(OPTISENSE_PT_shapes).texts)
    with pytest.raises(RuntimeError, match=f"{text}.*remove the cage"):
        bpy.ops.optisense.check()
    bpy.ops.optisense.remove_cage()
    after = gather(mini)[1]["gel"].vertices
    assert np.allclose(after[:-8], before, atol=1e-5)
    assert np.allclose(after[-8:].mean(axis=0), (5.0, 5.0, -2.0))
    select(gel)
    assert bpy.ops.optisense.new_cage() == {"FINISHED"}
    assert np.array_equal(gather(mini)[1]["gel"].vertices, after)
