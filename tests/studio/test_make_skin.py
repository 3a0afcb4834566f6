"""A sensing surface of a gel in one press: its outer faces, turned to face inward."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bmesh
import bpy
import numpy as np
import pytest

from studio.core import outer_faces
from studio.core.mesh_file import Mesh
from studio.core.outlines import face_normals
from studio.engine import session
from studio.scene.cages import cage_data, follow, shown_points
from studio.scene.collections import object_of, objects_of
from studio.scene.contacts import sensing_surface
from studio.scene.meshes import part_mesh, show_vertices, shown_vertices


def solid(make: Callable[[Any], Any]) -> Mesh:
    made = bmesh.new()
    make(made)
    bmesh.ops.triangulate(made, faces=made.faces)
    vertices = np.array([vertex.co for vertex in made.verts], dtype=np.float64)
    faces = np.array([[v.index for v in face.verts] for face in made.faces], dtype=np.int32)
    made.free()
    return Mesh(vertices, faces)


def without_skin(scene: Any) -> None:
    for cage in objects_of(scene, "CAGE"):
        bpy.ops.optisense.select_cage(cage=cage.optisense.key)
        bpy.ops.optisense.remove_cage()
    bpy.data.objects.remove(sensing_surface(scene))


def test_the_top_of_a_box_and_no_side() -> None:
    box = solid(lambda made: bmesh.ops.create_cube(made, size=2.0))
    for way in ((0.0, 0.0, 1.0), (0.0, -1.0, 0.0)):
        faces = outer_faces.outer_faces(box, np.array(way))
        assert len(faces) == 2
        skin = outer_faces.skin_of(box, faces)
        np.testing.assert_allclose(
            face_normals(skin.vertices[skin.faces]), [np.negative(way)] * 2, atol=1e-6
        )
        assert len(skin.vertices) == 4 and skin.vertices @ way == pytest.approx(1.0)


def test_a_dome_goes_on_by_tangency_and_ends_at_its_foot() -> None:
    ball = solid(lambda made: bmesh.ops.create_icosphere(made, subdivisions=3, radius=1.0))
    ball.vertices[:, 2] = np.maximum(ball.vertices[:, 2], 0.0)  # a half, with a flat foot
    faces = outer_faces.outer_faces(ball, np.array((0.0, 0.0, 1.0)))
    tops = ball.vertices[ball.faces].mean(axis=1)[:, 2] > 1e-6
    assert set(faces) == set(np.flatnonzero(tops))


def test_loose_corners_are_one() -> None:
    box = solid(lambda made: bmesh.ops.create_cube(made, size=2.0))
    loose = Mesh(box.vertices[box.faces].reshape(-1, 3), np.arange(36).reshape(-1, 3))
    faces = outer_faces.outer_faces(loose, np.array((0.0, 0.0, 1.0)))
    assert len(faces) == 2 and len(outer_faces.skin_of(loose, faces).vertices) == 4


def test_one_press_makes_the_skin_of_a_mini(mini: Any, select: Callable[..., None]) -> None:
    old = part_mesh(sensing_surface(mini), caged=False)
    with pytest.raises(RuntimeError, match="a sensing surface already"):
        bpy.ops.optisense.make_skin()
    without_skin(mini)
    select()
    assert bpy.ops.optisense.make_skin() == {"FINISHED"}
    skin = sensing_surface(mini)
    made = part_mesh(skin, caged=False)
    np.testing.assert_allclose(made.vertices.min(axis=0), old.vertices.min(axis=0), atol=1e-4)
    np.testing.assert_allclose(made.vertices.max(axis=0), old.vertices.max(axis=0), atol=1e-4)
    assert (face_normals(made.vertices[made.faces])[:, 2] < -0.99).all()  # it faces into the sensor
    bpy.ops.optisense.check()
    assert not session.state().problem


def test_the_skin_of_a_bent_gel_joins_its_cage(mini: Any, select: Callable[..., None]) -> None:
    (cage,) = objects_of(mini, "CAGE")
    points = shown_points(cage)
    points[14, 2] += 2.0  # lifts the middle of the skin by a quarter of that
    show_vertices(cage.data, points)
    follow(mini, cage)
    old = shown_vertices(sensing_surface(mini).data)[:, 2].max()
    bpy.data.objects.remove(sensing_surface(mini))
    gel = object_of(mini, "PART", "gel")
    select(gel)
    assert bpy.ops.optisense.make_skin() == {"FINISHED"}
    skin = sensing_surface(mini)
    heights = shown_vertices(skin.data)[:, 2]
    assert heights.max() == pytest.approx(shown_vertices(gel.data)[:, 2].max(), abs=1e-6)
    assert 0.2 < heights.max() <= old + 1e-6, "as far as the gel has vertices under its middle"
    assert skin.optisense.key in cage_data(cage)["parts"] and skin.optisense.is_caged
    bpy.ops.optisense.check()
    assert not session.state().problem
    bpy.ops.optisense.select_cage(cage=cage.optisense.key)
    bpy.ops.optisense.remove_cage()
    assert shown_vertices(skin.data)[:, 2].max() == pytest.approx(0.0, abs=1e-6)


def test_faces_can_be_chosen_by_hand(mini: Any, select: Callable[..., None]) -> None:
    without_skin(mini)
    gel = object_of(mini, "PART", "gel")
    select(gel)
    bpy.ops.object.mode_set(mode="EDIT")
    edited = bmesh.from_edit_mesh(gel.data)
    edited.faces.ensure_lookup_table()
    wanted = 0
    for face in edited.faces:
        face.select_set(face.normal.z > 0.9 and face.calc_center_median().x > 0.0)
        wanted += face.select
    bmesh.update_edit_mesh(gel.data)
    assert wanted > 0
    assert bpy.ops.optisense.make_skin() == {"FINISHED"}
    skin = sensing_surface(mini)
    assert len(skin.data.polygons) == wanted and bpy.context.mode == "OBJECT"


def test_contacts_stay_on_a_new_skin(mini: Any, select: Callable[..., None]) -> None:
    bpy.ops.optisense.add_contact()
    without_skin(mini)
    select(object_of(mini, "PART", "gel"))
    assert bpy.ops.optisense.make_skin() == {"FINISHED"}
    contact = objects_of(mini, "CONTACT")[0]
    contact.location = (3.0, 2.0, 9.0)
    bpy.context.view_layer.update()
    assert contact.matrix_world.translation.z == pytest.approx(0.0, abs=1e-5)
    object_of(mini, "PART", "skin").optisense.role = "blocker"
    object_of(mini, "PART", "gel").optisense.role = "sensing_surface"
    assert contact.constraints[0].target == object_of(mini, "PART", "gel")
