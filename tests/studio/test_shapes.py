"""Meshes that users bring, and what each kind of reference makes of them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest

from studio.engine import session
from studio.scene.collections import object_of, objects_of
from studio.scene.gather import gather_document

CUBE = "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nv 0 0 2\nv 2 0 2\nv 2 2 2\nv 0 2 2\n" + "".join(
    f"f {face}\n" for face in ("4 3 2 1", "5 6 7 8", "1 2 6 5", "2 3 7 6", "3 4 8 7", "4 1 5 8")
)
SHEET = "v -3 12 -9\nv 3 12 -9\nv 3 12 -6\nv -3 12 -6\nf 1 2 3 4\n"


@pytest.fixture
def bring(tmp_path: Path) -> Callable[..., Any]:
    """Adds a mesh file and says what it is for."""

    def brought(text: str, reference: str, name: str = "brought") -> Any:
        file = tmp_path / f"{name}.obj"
        file.write_text(text)
        assert bpy.ops.optisense.add_mesh(filepath=str(file)) == {"FINISHED"}
        item = bpy.context.active_object
        assert bpy.ops.optisense.set_reference(reference=reference) == {"FINISHED"}
        return item

    return brought


@pytest.mark.parametrize(
    ("reference", "material"),
    [
        ("support", "acrylic"),
        ("elastomer", "silicone"),
        ("mirror", "mirror-aluminium"),
        ("interface", "acrylic"),
        ("blocker", None),
        ("sensing_surface", None),
    ],
)
def test_references_become_parts(
    reference: str, material: str | None, mini: Any, bring: Callable[..., Any]
) -> None:
    shape = CUBE if reference in ("support", "elastomer", "blocker") else SHEET
    item = bring(shape, reference)
    assert item.optisense.reference == reference and item.hide_get()
    part = gather_document(mini)["parts"]["brought"]
    assert part["role"] == reference and part.get("material") == material
    made = object_of(mini, "PART", "brought")
    assert np.allclose(made.matrix_world @ made.data.vertices[1].co, item.data.vertices[1].co)
    assert list(bpy.context.selected_objects) == [made] and bpy.context.active_object == made


def test_an_indenter_reference_presses(mini: Any, bring: Callable[..., Any]) -> None:
    bring(CUBE, "indenter")
    (contact,) = objects_of(mini, "CONTACT")
    assert contact.optisense.indenter == "mesh" and len(contact.data.vertices) == 8
    assert "brought" not in gather_document(mini)["parts"]
    mini.optisense_simulation.size, mini.optisense_simulation.noise = "160", 50.0
    assert bpy.ops.optisense.simulate() == {"FINISHED"}
    assert "does not see" not in session.state().note


def test_an_indenter_reference_presses_on_another_day(
    mini: Any, bring: Callable[..., Any], tmp_path: Path
) -> None:
    bring(CUBE, "indenter")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "my sensor.blend"))
    session.stop()
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "my sensor.blend"))
    scene = bpy.context.scene
    scene.optisense_simulation.size, scene.optisense_simulation.noise = "160", 50.0
    assert bpy.ops.optisense.simulate() == {"FINISHED"}
    assert "does not see" not in session.state().note


def test_a_camera_and_lights_go_where_their_references_are(
    mini: Any, bring: Callable[..., Any], select: Callable[..., None]
) -> None:
    place = bring(CUBE, "camera")
    place.location = (0.0, 0.0, -20.0)
    bpy.context.view_layer.update()
    select(place)
    assert bpy.ops.optisense.add_camera(model="gelsight-mini") == {"FINISHED"}
    camera = gather_document(mini)["camera"]
    assert camera["position"] == [1.0, 1.0, -19.0]
    row = bring(SHEET, "light", "row")
    select(row)
    before = len(objects_of(mini, "LIGHT"))
    added = bpy.ops.optisense.add_light(group="red", count=3, pitch=1.5)
    assert added == {"FINISHED"}
    lights = objects_of(mini, "LIGHT")[before:]
    places = np.array([light.matrix_world.translation for light in lights])
    assert len(lights) == 3 and np.allclose(places[:, 1], 12.0, atol=1e-3)
    assert np.allclose(np.linalg.norm(np.diff(places, axis=0), axis=1), 1.5, atol=1e-3)


def test_a_file_that_is_no_mesh_is_told(mini: Any, tmp_path: Path) -> None:
    file = tmp_path / "text.obj"
    file.write_text("not a mesh\n")
    with pytest.raises(RuntimeError, match=r"text\.obj"):
        bpy.ops.optisense.add_mesh(filepath=str(file))


def test_lights_on_a_solid_look_at_the_sensing_surface(
    mini: Any, bring: Callable[..., Any], select: Callable[..., None]
) -> None:
    lamp = bring(CUBE, "light")
    lamp.location = (20.0, -1.0, -1.0)
    lamp.rotation_euler = (0.3, 0.2, 0.1)  # its faces' normals no longer add up to zero exactly
    bpy.context.view_layer.update()
    select(lamp)
    assert bpy.ops.optisense.add_light(model="smd-3528", group="NEW", name="side") == {"FINISHED"}
    (pose,) = gather_document(mini)["lights"]["side"]["lights"]
    surface = object_of(mini, "PART", "skin")
    corners = np.array([surface.matrix_world @ v.co for v in surface.data.vertices])
    way = (corners.min(axis=0) + corners.max(axis=0)) / 2 - pose["position"]
    assert np.allclose(pose["direction"], way / np.linalg.norm(way), atol=0.05)


def test_a_mesh_without_a_face_is_told(mini: Any, select: Callable[..., None]) -> None:
    empty = bpy.data.objects.new("nothing", bpy.data.meshes.new("nothing"))
    mini.collection.objects.link(empty)
    select(empty)
    for reference in ("support", "indenter"):
        with pytest.raises(RuntimeError, match="no face in nothing"):
            bpy.ops.optisense.set_reference(reference=reference)
    bpy.ops.optisense.set_reference(reference="light")
    select(empty)
    with pytest.raises(RuntimeError, match="has no vertices"):
        bpy.ops.optisense.add_light(model="smd-3528", group="NEW", name="side")
