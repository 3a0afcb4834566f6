"""How sensors are drawn: outlines without triangles, beams, the section, cages out of the way."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bmesh
import bpy
import numpy as np
import pytest

from studio.core import outlines
from studio.looks import drawing, section
from studio.scene.cages import show_idle
from studio.scene.collections import object_of, objects_of
from studio.scene.kinds import LOOKS


def shape_of(make: Callable[[Any], Any]) -> bpy.types.Object:
    made = bmesh.new()
    make(made)
    bmesh.ops.triangulate(made, faces=made.faces)
    mesh = bpy.data.meshes.new("shape")
    made.to_mesh(mesh)
    made.free()
    item = bpy.data.objects.new("shape", mesh)
    bpy.context.scene.collection.objects.link(item)
    return item


def test_a_box_has_twelve_lines_and_no_triangles(scene: Any) -> None:
    box = shape_of(lambda made: bmesh.ops.create_cube(made, size=2.0))
    lines = drawing.outline(box).reshape(-1, 2, 3)
    assert len(box.data.edges) == 18 and len(lines) == 12
    assert np.allclose(np.linalg.norm(lines[:, 1] - lines[:, 0], axis=1), 2.0)
    box.matrix_world.translation = (5.0, 0.0, 0.0)
    assert np.allclose(drawing.outline(box).mean(axis=0), (5.0, 0.0, 0.0))


def test_a_cylinder_has_its_two_rims_and_a_sheet_its_border(scene: Any) -> None:
    tube = shape_of(
        lambda made: bmesh.ops.create_cone(
            made, cap_ends=True, segments=32, radius1=1.0, radius2=1.0, depth=2.0
        )
    )
    assert len(drawing.outline(tube)) == 2 * 64
    sheet = shape_of(lambda made: bmesh.ops.create_grid(made, x_segments=3, y_segments=3, size=1))
    assert len(drawing.outline(sheet)) == 2 * 12


def test_outlines_follow_what_bends(mini: Any) -> None:
    skin = object_of(mini, "PART", "skin")
    before = drawing.outline(skin)
    shown = np.empty(3 * len(skin.data.vertices), dtype=np.float32)
    skin.data.vertices.foreach_get("co", shown)
    skin.data.vertices.foreach_set("co", shown + np.tile((0, 0, 2.0), len(shown) // 3))
    assert np.allclose(drawing.outline(skin) - before, (0.0, 0.0, 2.0), atol=1e-5)


@pytest.mark.parametrize("shape", ["disc", "rectangle"])
def test_a_beam_widens_by_its_angle_and_fades(shape: str) -> None:
    corners, left = outlines.beam(shape, (3.0, 2.0), 30.0, 4.0)
    near, far = corners[left == 1.0], corners[left == 0.0]
    assert len(near) + len(far) == len(corners) and len(corners) % 3 == 0
    assert np.allclose(near[:, 2], 0.0) and np.allclose(far[:, 2], -4.0)
    wider = np.hypot(*far[:, :2].T).max() - np.hypot(*near[:, :2].T).max()
    assert wider == pytest.approx(4.0 * np.tan(np.radians(30.0)), rel=1e-5)
    face = outlines.window(shape, (3.0, 2.0)).reshape(-1, 3, 3)
    area = np.linalg.norm(np.cross(face[:, 1] - face[:, 0], face[:, 2] - face[:, 0]), axis=1) / 2
    assert area.sum() == pytest.approx(6.0 if shape == "rectangle" else np.pi * 1.5**2, rel=0.02)


def test_the_section_goes_from_the_whole_sensor_to_nothing(mini: Any) -> None:
    looks = mini.optisense_looks
    assert section.plane(mini) is None
    looks.cut = True
    corners = np.concatenate([drawing.outline(each) for each in objects_of(mini, "PART")])
    for axis in "XYZ":
        looks.axis = axis
        shares = []
        for share in (0.0, 0.5, 1.0):
            looks.share = share
            a, b, c, d = section.plane(mini)
            shares.append((corners @ (a, b, c) + d > 0.0).mean())
        assert shares[0] == 1.0 and shares[2] == 0.0 and 0.0 < shares[1] < 1.0
    looks.axis, looks.share = "Z", 1.0
    assert len(drawing.cut(mini, corners[: len(corners) // 2 * 2], 2)) == 0


def test_gel_and_acrylic_are_glassy_and_nothing_is_drawn_as_wire(mini: Any) -> None:
    for part in objects_of(mini, "PART"):
        assert part.display_type == "TEXTURED"
    assert LOOKS["elastomer"][3] < 0.3 and LOOKS["support"][3] < 0.3 and LOOKS["blocker"][3] < 0.5
    assert LOOKS["mirror"][3] > 0.8


def test_clicks_find_a_cage_only_while_it_is_worked_at(
    mini: Any, select: Callable[..., None]
) -> None:
    cage = objects_of(mini, "CAGE")[0]
    select(objects_of(mini, "LIGHT")[0])
    show_idle(mini)
    assert cage.hide_select and cage.display_type == "BOUNDS"
    select(object_of(mini, "PART", "skin"))
    show_idle(mini)
    assert not cage.hide_select and cage.display_type == "TEXTURED"
    select(objects_of(mini, "LIGHT")[0])
    show_idle(mini)
    assert bpy.ops.optisense.select_cage(cage=cage.optisense.key) == {"FINISHED"}
    assert list(bpy.context.selected_objects) == [cage]
    with pytest.raises(RuntimeError, match="no cage 'wing'"):
        bpy.ops.optisense.select_cage(cage="wing")
