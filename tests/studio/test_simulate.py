"""What is simulated: as large as asked, with the contacts that are seen, whatever a draft says."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy
from waiting import until

from studio.engine import design_transfer, session
from studio.scene.collections import object_of, objects_of
from studio.scene.objects_at import objects_at
from studio.scene.subject import Subject
from studio.simulate import drafts

IES = "IESNA:LM-63-2002\nTILT=NONE\n1 100 1 3 1 1 1 0 0 0\n1 1 1\n0 45 90\n0\n100 50 0\n"


def test_pictures_have_the_proportions_of_the_sensors_camera(mini: Any) -> None:
    mini.optisense_simulation.size, mini.optisense_simulation.noise = "160", 50.0
    objects_of(mini, "CAMERA")[0].optisense.pixels = (200, 100)
    other = bpy.data.objects.new("view", bpy.data.cameras.new("view"))
    mini.collection.objects.link(other)
    for camera in (other, None):  # a camera to make a film with, and none
        mini.camera = camera
        assert bpy.ops.optisense.simulate() == {"FINISHED"}
        assert bpy.context.window_manager.optisense_picture.summary.startswith("160 x 80")


def test_an_ies_file_from_anywhere_joins_the_design(mini: Any, tmp_path: Path) -> None:
    elsewhere = tmp_path / "my lamps" / "lämp 1.ies"
    elsewhere.parent.mkdir()
    elsewhere.write_text(IES, encoding="ascii")
    group = mini.optisense.light_groups["red"]
    group.emitter = "ies"
    group.put("file", str(elsewhere))
    bpy.ops.optisense.check()
    assert not session.state().problem
    assert bpy.ops.optisense.save_as(filepath=str(tmp_path / "mini")) == {"FINISHED"}
    assert (tmp_path / "mini" / elsewhere.name).read_text() == IES
    elsewhere.unlink()  # the design has one of its own now
    assert bpy.ops.optisense.save() == {"FINISHED"}
    assert bpy.ops.optisense.open(filepath=str(tmp_path / "mini" / "design.yaml")) == {"FINISHED"}
    assert mini.optisense.light_groups["red"].value("file") == elsewhere.name
    mini.optisense.light_groups["red"].put("file", "../gone.ies")
    bpy.ops.optisense.check()
    assert "gone.ies" in session.state().problem
    assert {each.optisense.group for each in bpy.context.selected_objects} == {"red"}


def test_hidden_contacts_do_not_press(mini: Any) -> None:
    for _ in range(2):
        bpy.ops.optisense.add_contact()
    contact = objects_of(mini, "CONTACT")[0]
    folder = bpy.context.view_layer.layer_collection.children["Contacts"]
    assert len(design_transfer.contacts(mini)) == 2
    contact.hide_set(True)
    assert len(design_transfer.contacts(mini)) == 1
    contact.hide_set(False)
    contact.hide_viewport = True
    assert len(design_transfer.contacts(mini)) == 1
    contact.hide_viewport = False
    for hide in ("hide_viewport", "exclude"):
        setattr(folder, hide, True)
        assert design_transfer.contacts(mini) == []
        setattr(folder, hide, False)
    assert len(design_transfer.contacts(mini)) == 2


def test_forces_go_to_the_contacts_that_were_sent(mini: Any) -> None:
    settings = mini.optisense_simulation
    settings.size, settings.noise = "160", 100.0
    for x, force in ((-4.0, 3.0), (0.0, 2.0), (4.0, 0.5)):
        bpy.ops.optisense.add_contact()
        contact = bpy.context.active_object
        contact.location.x, contact.name = contact.location.x + x, f"{force} N"
        contact.optisense.press_by, contact.optisense.force = "FORCE", force
    hidden, gone, last = objects_of(mini, "CONTACT")
    before = hidden.optisense.depth
    assert bpy.ops.optisense.simulate(wait=False) == {"FINISHED"}
    hidden.hide_set(True)
    bpy.data.objects.remove(gone)
    mini.name = "Another name"
    until(lambda: not session.is_busy())
    said = bpy.context.window_manager.optisense_picture.presses.splitlines()
    assert [line.partition(":")[0] for line in said] == ["3.0 N", "0.5 N"]
    assert hidden.optisense.depth != before, "it was pressed when the picture was asked for"
    assert hidden.optisense.depth > last.optisense.depth


def test_an_error_selects_what_it_was_about_when_the_design_was_sent(mini: Any) -> None:
    for _ in range(3):
        bpy.ops.optisense.add_contact()
    hidden, gone, last = objects_of(mini, "CONTACT")
    red = [each for each in objects_of(mini, "LIGHT") if each.optisense.group == "red"]
    subject = Subject(mini)
    assert objects_at(subject, "", "", 1) == [gone]
    hidden.hide_set(True)
    for each in (gone, red[0]):
        bpy.data.objects.remove(each)
    assert objects_at(subject, "", "", 2) == [last]
    assert objects_at(subject, "", "", 1) == objects_at(subject, "", "", 0) == []
    assert objects_at(subject, "lights.red.lights[1].position", "") == [red[1]]
    assert objects_at(subject, "lights.red.lights[0].position", "") == []
    assert objects_at(subject, "lights.red", "") == red[1:]
    mini.optisense.opening = "another sensor"
    assert subject.scene is None and not objects_at(subject, "lights.red", "")


def test_a_draft_that_can_not_be_made_selects_nothing_and_is_forgotten(
    mini: Any, select: Callable[..., None]
) -> None:
    gel, light = object_of(mini, "PART", "gel"), objects_of(mini, "LIGHT")[0]
    select(light)
    now = session.state()

    def draft() -> None:
        light.location.z -= 0.25
        bpy.context.view_layer.update()
        drafts._soon()
        until(lambda: not drafts._wanted and all(each.done for each in drafts._open))

    mini.optisense_simulation.draft = True
    material, gel.optisense.material = gel.optisense.material, ""
    draft()
    assert "'gel'" in now.note
    gel.optisense.material = material
    draft()
    assert not now.note
    gel.optisense.material, opening = "", mini.optisense.opening
    drafts.wanted()
    drafts._soon()
    mini.optisense.opening = "another sensor"
    for each in drafts._open:
        session.engine().wait(each)
    assert not now.note, "it is about the earlier sensor"
    gel.optisense.material, mini.optisense.opening = material, opening
    objects_of(mini, "CAMERA")[0].optisense.kind = "NONE"
    draft()
    assert "no camera" in now.note and not now.problem
    assert list(bpy.context.selected_objects) == [light]
