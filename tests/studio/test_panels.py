"""Registration, every panel in every state, and why buttons are grey."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import bpy
import pytest
from recording import Recording, draw, menus, panels
from waiting import until

import studio
from studio.calibrate.operator import OPTISENSE_OT_keep_family
from studio.engine import catalogue, session
from studio.scene.collections import object_of, objects_of

STEPS = [
    "Sensor",
    "Shapes",
    "Materials",
    "Lights and Camera",
    "Simulate",
    "Evaluate",
    "Optimise",
    "Report and Export",
    "Calibrate",
]


def draw_all() -> dict[str, Recording]:
    drawn = {panel.bl_label: draw(panel) for panel in panels()}
    for menu in menus():
        assert draw_menu(menu) is not None
    return {label: layout for label, layout in drawn.items() if layout is not None}


def draw_menu(menu: type) -> Recording:
    layout = Recording()
    menu.draw(SimpleNamespace(layout=layout), bpy.context)
    return layout


def test_registers_twice_over_and_leaves_nothing_behind() -> None:
    studio.unregister()
    assert not hasattr(bpy.types.Scene, "optisense")
    assert not hasattr(bpy.types.Object, "optisense")
    assert not hasattr(bpy.types.WindowManager, "optisense")
    assert not [name for name in dir(bpy.types) if name.startswith("OPTISENSE_")]
    handlers = [h for name in dir(bpy.app.handlers) for h in _list(name)]
    assert not [h for h in handlers if h.__module__.startswith("studio")]
    studio.register()
    studio.unregister()
    studio.register()


def _list(name: str) -> list[Any]:
    handlers = getattr(bpy.app.handlers, name)
    return handlers if isinstance(handlers, list) else []


def test_the_tab_has_the_steps_in_order() -> None:
    assert [panel.bl_label for panel in panels()] == STEPS
    assert all(panel.bl_category == "OptiSense" for panel in panels())


def test_without_a_sensor_only_its_panel_is_drawn(scene: Any) -> None:
    drawn = draw_all()
    assert list(drawn) == ["Sensor"]
    assert "optisense.open" in drawn["Sensor"].operators


def test_without_an_engine_the_panel_says_how_to_get_one(
    scene: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("OPTISENSE_ENGINE", "")
    monkeypatch.setenv("PATH", "")
    assert "optisense studio" in " ".join(draw_all()["Sensor"].texts)


def test_every_panel_with_each_kind_of_object(mini: Any, select: Callable[..., None]) -> None:
    bpy.ops.optisense.add_contact()
    chosen = [objects_of(mini, kind)[0] for kind in ("LIGHT", "CAMERA", "CAGE", "CONTACT")]
    chosen += [object_of(mini, "PART", name) for name in ("skin", "gel")]
    for each in chosen:
        select(each)
        assert list(draw_all()) == STEPS
    select()
    assert list(draw_all()) == STEPS
    contact = objects_of(mini, "CONTACT")[0]
    select(contact)
    for kind, shown in (("cylinder", "length"), ("plane", "tilt"), ("mesh", "file")):
        contact.optisense.indenter = kind
        assert shown in draw_all()["Simulate"].properties
    catalogue.learn_kinds()
    group = mini.optisense.light_groups[0]
    for kind, shown in (("area", "pair"), ("ies", "file"), ("spot", "number")):
        group.emitter = kind
        assert shown in draw_all()["Lights and Camera"].properties
    select(object_of(mini, "PART", "gel"))
    for kind in ("dielectric", "conductor", "diffuse", "absorber"):
        mini.optisense.materials["silicone-xp565"].kind = kind
        assert "kind" in draw_all()["Materials"].properties


def test_objectives_and_methods_are_chosen_from_lists(mini: Any) -> None:
    test_menus_are_filled_by_the_engine(mini)
    search, found = mini.optisense_search, bpy.context.window_manager.optisense_found
    for name in ("rgb2normal", "2to3pw"):
        found.objective_choice = name
        assert search.objective == name
    for name in ("random", "grid"):
        found.method_choice = name
        assert search.method == name


def test_whatever_can_be_set_says_what_it_is(mini: Any, select: Callable[..., None]) -> None:
    silent = []
    for name in dir(bpy.ops.optisense):
        kind = getattr(bpy.ops.optisense, name).get_rna_type()
        assert kind.name and kind.description, name
        silent += [f"{name}.{each.identifier}" for each in kind.properties if _is_silent(each)]
    for root in (bpy.types.Scene, bpy.types.Object, bpy.types.WindowManager):
        for pointer in root.bl_rna.properties:
            if pointer.identifier.startswith("optisense"):
                silent += _silent(pointer.fixed_type)
    assert not silent


TOLD = {"session", "picture", "score"}
"""Properties that panels show and users do not set."""


def _silent(group: Any) -> list[str]:
    found = []
    for each in group.properties:
        if each.type in ("POINTER", "COLLECTION") and each.fixed_type:
            if each.fixed_type.identifier.startswith("OPTISENSE"):
                found += _silent(each.fixed_type)
        elif group.identifier.removeprefix("OPTISENSE_PG_") not in TOLD and _is_silent(each):
            found.append(f"{group.identifier}.{each.identifier}")
    return found


def _is_silent(each: Any) -> bool:
    told = each.identifier in ("rna_type", "name") or each.is_hidden or each.is_readonly
    return not told and not each.description


def test_messages_and_progress_are_drawn(mini: Any) -> None:
    now = session.state()
    now.busy, now.fraction, now.progress = "Simulating", 0.4, "1.0 million photons"
    drawn = draw_all()["Simulate"]
    assert "1.0 million photons" in drawn.texts
    assert "optisense.simulate" not in drawn.operators and "optisense.cancel" in drawn.operators
    now.busy = ""
    assert "optisense.simulate" in draw_all()["Simulate"].operators
    now.problem, now.hint = "The gel leaks", "Close it"
    texts = draw_all()["Sensor"].texts
    assert "The gel leaks" in texts and "Close it" in texts


def test_a_material_that_was_refused_is_told_beside_its_button(
    mini: Any, select: Callable[..., None]
) -> None:
    select(object_of(mini, "PART", "gel"))
    with pytest.raises(RuntimeError):
        bpy.ops.optisense.keep_material(name="my-silicone", source="")
    problem = session.state().problem
    assert problem
    assert problem.split()[0] in " ".join(draw_all()["Materials"].texts)


def test_menus_are_filled_by_the_engine(scene: Any) -> None:
    session.engine()
    until(lambda: catalogue.entries("methods") and catalogue.entries("camera"))
    assert {"rgb2normal", "normdiff", "aoap", "2to3pw"} <= {
        entry["name"] for entry in catalogue.entries("objectives")
    }
    layout = draw_menu(bpy.types.OPTISENSE_MT_new)
    built_in = [each for each in layout.operators if each == "optisense.new"]
    assert len(built_in) == len(catalogue.entries("sensors")) >= 6
    assert layout.operators[len(built_in) :] == ["optisense.new_empty", "optisense.cad_files"]


@pytest.mark.parametrize(
    ("operator", "why"),
    [
        ("simulate", "no sensor yet"),
        ("evaluate", "no sensor yet"),
        ("search", "no sensor yet"),
        ("save", "no sensor yet"),
        ("clear_contacts", "no contacts"),
        ("cancel", "No job is running"),
        ("report", "Simulate a whole picture first"),
        ("hide_rays", "No rays"),
        ("show_picture", "Simulate first"),
    ],
)
def test_grey_buttons_say_why(operator: str, why: str, scene: Any) -> None:
    with pytest.raises(RuntimeError, match=why):
        getattr(bpy.ops.optisense, operator)()


@pytest.mark.parametrize(
    ("operator", "why"),
    [
        ("apply_material", "Select a part first"),
        ("new_cage", "Select the parts to bend first"),
        ("edit_shape", "Select a cage"),
        ("set_reference", "Select a mesh first"),
        ("set_group", "Select lights first"),
        ("keep_material", "Select a part first"),
        ("search", "Add a parameter with Vary first"),
        ("resume", "There is no study yet"),
        ("save", "This sensor has no folder yet"),
    ],
)
def test_nothing_selected_is_said(
    operator: str, why: str, mini: Any, select: Callable[..., None]
) -> None:
    select()
    test_menus_are_filled_by_the_engine(mini)
    with pytest.raises(RuntimeError, match=why):
        getattr(bpy.ops.optisense, operator)()


def test_each_group_of_numbers_of_the_calibration_is_explained(scene: Any) -> None:
    session.ask_and_wait("calibration_families")
    until(lambda: catalogue.entries("calibration_families"))
    rows = catalogue.entries("calibration_families")
    told = [
        OPTISENSE_OT_keep_family.description(bpy.context, SimpleNamespace(family=row["name"]))
        for row in rows
    ]
    assert len(set(told)) == len(rows)
    assert all(row["words"] in text for row, text in zip(rows, told, strict=True))
