"""File -> Blender -> file: every field of every built-in sensor, and every edit undone."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest

from studio.engine import design_transfer, session
from studio.scene import cages
from studio.scene.collections import ALL, object_of, objects_of
from studio.scene.gather import gather, gather_document
from studio.scene.lamps import redraw
from studio.scene.meshes import shown_vertices
from studio.sensor import opening

SENSORS = (
    "gelbelt",
    "gelsight360",
    "gelsight-mini-ideal",
    "gelsight-mini-ideal-spherical",
    "gelsight-svelte",
)


def as_read(design: Any) -> tuple[dict[str, Any], dict[str, Any]]:
    """A design and its meshes as the engine reads them; an absent list is an empty one."""
    answer = session.ask_and_wait("open", design=design, name="as-read")
    document = design_transfer.without_nulls(answer["data"])
    for cage in document["cages"].values():
        cage.setdefault("points", [])
    meshes = {
        name: (np.load(files["vertices"]), np.load(files["faces"]))
        for name, files in answer["meshes"].items()
    }
    return document, meshes


@pytest.mark.parametrize("sensor", SENSORS)
def test_every_field_of_a_sensor_comes_back(sensor: str, scene: Any, tmp_path: Path) -> None:
    bpy.ops.optisense.new(sensor=sensor)
    assert bpy.ops.optisense.save_as(filepath=str(tmp_path / "saved")) == {"FINISHED"}
    before, meshes_before = as_read(f"builtin:{sensor}")
    after, meshes_after = as_read(str(tmp_path / "saved"))
    assert after == before
    assert list(after["parts"]) == list(before["parts"])
    assert meshes_after.keys() == meshes_before.keys()
    for name, (vertices, faces) in meshes_before.items():
        assert np.array_equal(meshes_after[name][0], vertices), name
        assert np.array_equal(meshes_after[name][1], faces), name


def test_what_blender_does_not_show_of_a_design_comes_back(scene: Any, tmp_path: Path) -> None:
    bpy.ops.optisense.new(sensor="gelsight-mini-ideal")
    bpy.ops.optisense.save_as(filepath=str(tmp_path / "plain"))
    file = tmp_path / "plain" / "design.yaml"
    frost = "    faces: {end: {direction: [0, 1, 0], within: 10, roughness: 0.4}}\n"
    text = file.read_text().replace("  guide:\n", "  guide:\n" + frost)
    spectrum = "    spectrum: {red: {wavelength: 622, half_width: 18}}\n"
    text = text.replace("  red:\n", "  red:\n" + spectrum)
    file.write_text(text + "dispersion: true\n")
    bpy.ops.optisense.open(filepath=str(tmp_path / "plain"))
    assert bpy.ops.optisense.save_as(filepath=str(tmp_path / "saved")) == {"FINISHED"}
    before, after = (as_read(str(tmp_path / name))[0] for name in ("plain", "saved"))
    assert before["lights"]["red"]["spectrum"]["red"]["wavelength"] == 622
    assert before["parts"]["guide"]["faces"]["end"]["roughness"] == 0.4
    assert after == before


def test_the_reading_of_specularity_is_written_where_it_is_chosen(mini: Any) -> None:
    coating = mini.optisense.coating
    assert coating.value("scattering") == "blend"
    assert "scattering" not in gather_document(mini)["coating"]
    coating.put("scattering", "conductor")
    assert gather_document(mini)["coating"]["scattering"] == "conductor"
    assert session.ask_and_wait("check", design=design_transfer.design(mini))["problems"] == []
    coating.put("scattering", "blend")
    assert "scattering" not in gather_document(mini)["coating"]


def test_meshes_keep_their_double_precision(scene: Any) -> None:
    bpy.ops.optisense.new(sensor="gelsight-svelte")
    _, meshes = gather(bpy.context.scene)
    vertices = meshes["M1"].vertices
    assert not np.array_equal(vertices, vertices.astype(np.float32))


def test_the_design_lives_in_its_collections(mini: Any) -> None:
    names = [each.name for each in mini.collection.children]
    assert all(name in names for name in ALL)
    system = bpy.data.collections["OpticalSystem"].objects
    assert {"skin", "gel", "tray", "guide", "camera"} <= {each.name for each in system}
    assert sum(each.optisense.kind == "LIGHT" for each in system) == 15
    assert [each.optisense.key for each in bpy.data.collections["Cages"].objects] == ["skin"]


def test_opening_again_replaces_the_sensor(mini: Any) -> None:
    count = len(mini.objects)
    bpy.ops.optisense.new(sensor="gelsight-mini-ideal")
    assert len(mini.objects) == count


def test_a_saved_folder_is_not_overwritten_by_another_sensor(mini: Any, tmp_path: Path) -> None:
    bpy.ops.optisense.save_as(filepath=str(tmp_path / "a"))
    assert bpy.ops.optisense.save() == {"FINISHED"}
    bpy.ops.optisense.new(sensor="gelbelt")
    with pytest.raises(RuntimeError):
        bpy.ops.optisense.save_as(filepath=str(tmp_path / "a"))
    assert bpy.ops.optisense.open(filepath=str(tmp_path / "a" / "design.yaml")) == {"FINISHED"}
    assert mini.optisense.title == "gelsight-mini-ideal"


def test_a_design_that_another_program_changed_is_not_overwritten(
    mini: Any, tmp_path: Path
) -> None:
    bpy.ops.optisense.save_as(filepath=str(tmp_path / "a"))
    bpy.ops.ed.undo_push(message="Save")
    mini.optisense.description = "mine"
    bpy.ops.ed.undo_push(message="Describe")
    assert bpy.ops.optisense.save() == {"FINISHED"}
    bpy.ops.ed.undo()
    assert bpy.ops.optisense.save() == {"FINISHED"}
    file = tmp_path / "a" / "design.yaml"
    changed = file.read_text().replace("flux: 2.1", "flux: 7.5")
    file.write_text(changed)
    with pytest.raises(RuntimeError, match="was changed on disk since it was opened here"):
        bpy.ops.optisense.save()
    assert file.read_text() == changed
    assert bpy.ops.optisense.save_as(filepath=str(tmp_path / "b")) == {"FINISHED"}
    bpy.ops.optisense.open(filepath=str(file))
    assert bpy.ops.optisense.save() == {"FINISHED"}
    file.write_text(changed.replace("7.5", "8.5"))
    with pytest.raises(RuntimeError, match="was changed on disk"):
        bpy.ops.optisense.save()


def test_undo_leaves_the_folder_in_which_a_sensor_was_saved(mini: Any, tmp_path: Path) -> None:
    first, second = tmp_path / "a", tmp_path / "b"
    for folder in (first, second):
        assert bpy.ops.optisense.save_as(filepath=str(folder)) == {"FINISHED"}
        bpy.context.scene.optisense.description = f"after {folder.name}"
        bpy.ops.ed.undo_push(message="Describe")
    before = (first / "design.yaml").read_bytes()
    bpy.ops.ed.undo()
    assert bpy.context.scene.optisense.description == "after a"
    assert bpy.ops.optisense.save() == {"FINISHED"}
    assert (first / "design.yaml").read_bytes() == before
    assert "after a" in (second / "design.yaml").read_text()

    bpy.ops.optisense.open(filepath=str(first))
    bpy.ops.ed.undo()
    assert bpy.context.scene.optisense.folder == str(second), "that of the sensor before"
    bpy.ops.ed.redo()
    assert bpy.context.scene.optisense.folder == str(first)
    bpy.ops.ed.undo()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "b.blend"))
    bpy.ops.optisense.save_as(filepath=str(tmp_path / "c"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "b.blend"))
    opening._keep_folders()
    assert bpy.context.scene.optisense.folder == str(second), "as the .blend file says"


def test_what_is_edited_is_written_and_nothing_else(mini: Any) -> None:
    before = gather_document(mini)
    light = objects_of(mini, "LIGHT")[0]
    light.location.z = -7.0
    mini.optisense.coating.put("specularity", 0.3)
    mini.optisense.light_groups["blue"].flux = 1.2
    camera = objects_of(mini, "CAMERA")[0]
    camera.optisense.fov = 60.5
    after = gather_document(mini)
    assert after["lights"]["red"]["lights"][0]["position"] == [-8.0, 10.575, -7.0]
    assert after["coating"]["specularity"] == 0.3
    assert after["lights"]["blue"]["flux"] == 1.2
    assert after["camera"]["fov"] == 60.5
    assert np.degrees(camera.data.angle) == pytest.approx(60.5, abs=1e-4)
    after["lights"]["red"]["lights"][0] = before["lights"]["red"]["lights"][0]
    after["lights"]["blue"]["flux"] = before["lights"]["blue"]["flux"]
    after["coating"]["specularity"] = before["coating"]["specularity"]
    after["camera"]["fov"] = before["camera"]["fov"]
    after["provenance"] = before["provenance"]
    assert after == before


def test_what_is_changed_no_longer_has_the_source_it_had(mini: Any) -> None:
    before = gather_document(mini)["provenance"]
    assert {"camera.fov", "camera.position", "lights.red.flux", "parts.guide"} <= before.keys()
    objects_of(mini, "CAMERA")[0].optisense.fov = 61.0
    bpy.data.objects.remove(object_of(mini, "PART", "guide"))
    after = gather_document(mini)["provenance"]
    assert after["camera.fov"]["status"] == "assumed" and "by hand" in after["camera.fov"]["source"]
    assert "parts.guide" not in after
    changed = {path for path in before if after.get(path) != before[path]}
    assert changed == {"camera.fov", "parts.guide"}
    assert session.ask_and_wait("check", design=design_transfer.design(mini))["problems"] == []


def test_copies_made_in_blender_join_the_sensor(mini: Any, select: Callable[..., None]) -> None:
    select(objects_of(mini, "LIGHT")[0])
    bpy.ops.object.duplicate()
    bpy.context.active_object.location.x += 2.0
    select(object_of(mini, "PART", "guide"))
    bpy.ops.object.duplicate()
    document, meshes = gather(mini)
    assert len(document["lights"]["red"]["lights"]) == 6
    assert len(document["parts"]) == 5
    files = [part["mesh"] for part in document["parts"].values()]
    assert len(set(files)) == 5
    assert list(meshes) == list(document["parts"])


def test_a_copy_is_a_part_of_its_own(mini: Any, select: Callable[..., None]) -> None:
    document, meshes = gather(mini)
    gel, tray = (object_of(mini, "PART", name) for name in ("gel", "tray"))
    tray.optisense.key = "gel-001"  # as a copy that was saved and opened again
    for original in (gel, objects_of(mini, "LIGHT")[1]):
        select(original)
        bpy.ops.object.duplicate()
        bpy.context.active_object.location.z -= 30.0
        original.name = "zz"
    after, found = gather(mini)
    assert list(found) == ["skin", "gel", "gel-001", "guide", "gel-001-2"]
    assert after["cages"] == document["cages"]
    assert np.array_equal(found["gel"].vertices, meshes["gel"].vertices)
    assert np.array_equal(found["gel-001"].vertices, meshes["tray"].vertices)
    assert found["gel-001-2"].vertices[:, 2].max() == pytest.approx(-30.0)
    assert after["lights"]["red"]["lights"][:5] == document["lights"]["red"]["lights"]
    assert gel.optisense.is_caged and not object_of(mini, "PART", "gel-001-2").optisense.is_caged
    bpy.data.objects.remove(gel)
    assert list(gather(mini)[1]) == ["skin", "gel-001", "guide", "gel-001-2"]


def test_a_moved_part_is_written_where_it_is(mini: Any) -> None:
    tray = object_of(mini, "PART", "tray")
    _, before = gather(mini)
    tray.location.z = -1.5
    _, after = gather(mini)
    assert np.allclose(after["tray"].vertices, before["tray"].vertices + [0, 0, -1.5], atol=1e-9)


@pytest.mark.parametrize(
    "edit",
    [
        lambda scene: bpy.ops.optisense.add_contact(),
        lambda scene: bpy.ops.optisense.add_light(group="red", count=2),
        lambda scene: setattr(objects_of(scene, "LIGHT")[3], "location", (1, 2, 3)),
        lambda scene: scene.optisense.coating.put("specularity", 0.8),
        lambda scene: setattr(objects_of(scene, "CAMERA")[0].optisense, "fov", 71.0),
        lambda scene: bpy.data.objects.remove(object_of(scene, "PART", "tray")),
    ],
    ids=["contact", "lights", "move", "coating", "camera", "remove"],
)
def test_every_edit_can_be_undone(edit: Callable[[Any], Any], mini: Any) -> None:
    before = gather_document(mini)
    contacts = len(objects_of(mini, "CONTACT"))
    edit(mini)
    bpy.ops.ed.undo_push(message="An edit")
    scene = bpy.context.scene
    changed = gather_document(scene) != before or len(objects_of(scene, "CONTACT")) != contacts
    assert changed
    bpy.ops.ed.undo()
    scene = bpy.context.scene
    assert gather_document(scene) == before
    assert len(objects_of(scene, "CONTACT")) == contacts


def test_undo_of_a_bent_cage_straightens_its_parts(mini: Any) -> None:
    skin = object_of(mini, "PART", "skin")
    flat = cages.shown_vertices(skin.data).copy()
    cage = objects_of(mini, "CAGE")[0]
    cage.data.vertices[14].co.z += 9.0
    cage.data.update()
    bpy.context.view_layer.update()
    assert cages.shown_vertices(skin.data)[:, 2].max() == pytest.approx(9.0 / 4, abs=1e-5)
    bpy.ops.ed.undo_push(message="Bend")
    bpy.ops.ed.undo()
    skin = object_of(bpy.context.scene, "PART", "skin")
    assert np.array_equal(cages.shown_vertices(skin.data), flat)


def test_what_a_camera_does_with_light_comes_back(scene: Any, tmp_path: Path) -> None:
    bpy.ops.optisense.new(sensor="gelsight-mini-ideal")
    bpy.ops.optisense.add_camera(model="pi-v2", imaging=True)
    assert bpy.ops.optisense.save_as(filepath=str(tmp_path / "saved")) == {"FINISHED"}
    camera = as_read(str(tmp_path / "saved"))[0]["camera"]
    assert camera["noise"]["full_well"] == 4561.6
    assert camera["tone_curve"]["kind"] == "points" and len(camera["shading"]["gain"]) == 12
    assert "f_number" not in camera
    bpy.ops.optisense.open(filepath=str(tmp_path / "saved"))
    assert bpy.ops.optisense.save_as(filepath=str(tmp_path / "again")) == {"FINISHED"}
    assert as_read(str(tmp_path / "again"))[0]["camera"] == camera
    bpy.ops.optisense.add_camera(model="pi-v2")
    assert set(gather_document(bpy.context.scene)["camera"]) == {
        *("model", "projection", "fov", "resolution"),
        *("position", "direction", "up"),
    }


def test_a_sensor_in_a_linked_copy_of_a_scene_leaves_that_alone(mini: Any) -> None:
    bpy.ops.optisense.add_contact()
    before, meshes = gather(mini)
    bpy.ops.scene.new(type="LINK_COPY")
    copy = bpy.context.scene
    assert copy != mini and objects_of(copy, "PART") == objects_of(mini, "PART")
    assert bpy.ops.optisense.new_empty() == {"FINISHED"}
    assert not objects_of(copy, "PART") and len(objects_of(copy, "CONTACT")) == 1
    assert bpy.ops.optisense.new(sensor="gelsight-mini-ideal") == {"FINISHED"}
    assert not objects_of(copy, "CONTACT") and objects_of(copy, "PART")
    assert not set(copy.objects) & set(mini.objects)
    lamp, other = (objects_of(each, "LIGHT")[0].data for each in (mini, copy))
    size = shown_vertices(lamp)
    group = copy.optisense.light_groups[0]
    group.drawn = json.dumps({"window": {"shape": "disc", "size": [9.0, 9.0]}})
    redraw(copy, group)
    assert shown_vertices(other).max() == pytest.approx(4.5)
    assert np.array_equal(shown_vertices(lamp), size)
    bpy.context.window.scene = mini
    after, found = gather(mini)
    assert after == before and found.keys() == meshes.keys()
    assert len(objects_of(mini, "CONTACT")) == 1
