"""Errors of a user and the way back, hints before a search, and what panels tell, by mouse and
keys.

The steps build on one another, as a user's do.
"""

from __future__ import annotations

from .bench import Bench
from .sidebar import PANELS, ROW
from .test_by_hand import LIGHTS, SIMULATE, VARY
from .test_rows_by_hand import EVALUATE
from .test_searching_by_hand import OPTIMISE

MATERIALS = 2
"""The panel's place in the sidebar; the first is 0."""

COLUMNS = (0.25, 0.75)
"""Where controls are looked for, 0 is the sidebar's left edge and 1 its right one."""

CONTROLS = 60
"""Number of controls that are found in all panels at least."""

PACKAGE = "gs_sdk"
"""Name of a package that a tooltip mentions."""

SEARCH = "scene().optisense_search"
PROBLEM = "state().problem"
GREEN = "part('lights.group_selection').lights_of(scene(), 'green')"
SCORES = "manager.optisense_evaluation.scores"


def test_an_empty_sensor_is_begun(bench: Bench) -> None:
    bench.greet()
    bench.open_tab()
    bench.until("bool(part('engine.catalogue').entries('sensors'))")
    x, y = bench.find("optisense.open", across=0.25)
    bench.desktop.click(x, y - 22)
    bench.desktop.keys("End", "Up", "Return")
    bench.until("scene().optisense.is_open and not state().busy")
    assert not bench.see("kinds('PART') or kinds('LIGHT')")
    bench.photograph("empty")
    bench.press("optisense.check")
    told = bench.refused()
    assert "no part" in told, told
    bench.photograph("empty-checked")


def test_a_click_on_a_light_chooses_its_group(bench: Bench) -> None:
    bench.new_sensor("gelsight-mini-ideal")
    bench.until(f"not {PROBLEM}")
    bench.only(LIGHTS)
    for light in bench.see(f"[each.name for each in {GREEN}]"):
        spot = f"on_screen(bpy.data.objects[{light!r}].matrix_world.translation)"
        bench.desktop.click(*bench.see(spot))
        if bench.see("bpy.context.view_layer.objects.active.name") == light:
            break
    else:
        raise AssertionError("no green light can be clicked on")
    index = "scene().optisense.light_group_index"
    bench.until(f"scene().optisense.light_groups[{index}].name == 'green'")


def test_a_contact_does_not_move_the_button_below(bench: Bench) -> None:
    bench.only(SIMULATE)
    before = bench.find("optisense.simulate")
    bench.press("optisense.add_contact", across=0.75)
    bench.until("len(kinds('CONTACT')) == 1")
    bench.drawn()
    assert abs(bench.find("optisense.simulate")[1] - before[1]) <= 3
    bench.photograph("contact-selected")


def test_a_deleted_camera_is_told_until_it_is_back(bench: Bench) -> None:
    camera = bench.see("kinds('CAMERA')[0].name")
    spot = f"on_screen(bpy.data.objects[{camera!r}].matrix_world.translation)"
    bench.desktop.click(*bench.see(spot))
    bench.until(f"bpy.context.view_layer.objects.active.name == {camera!r}")
    bench.desktop.keys("Delete")
    bench.until("not kinds('CAMERA')")
    bench.press("optisense.simulate")
    told = bench.refused()
    assert "camera" in told
    bench.photograph("no-camera")
    bench.over_view()
    bench.desktop.keys("ctrl+z")
    bench.until(f"len(kinds('CAMERA')) == 1 and not {PROBLEM}", refused=True)


def test_a_search_that_cannot_succeed_is_refused(bench: Bench) -> None:
    bench.only(0)
    bench.press("optisense.save_as", across=0.85)
    bench.choose_file()
    bench.until("scene().optisense.is_saved")
    bench.rest()
    bench.desktop.click(*bench.see(f"on_screen({GREEN}[2].matrix_world.translation)"))
    bench.until("bpy.context.view_layer.objects.active.optisense.kind == 'LIGHT'")
    bench.only(OPTIMISE)
    labels = bench.see("[e.label for e in part('optimise.suggestions').suggestions(bpy.context)]")
    flux = next(number for number, label in enumerate(labels) if "flux" in label.lower())
    bench.choose(bench.find(VARY), flux)
    bench.until(f"len({SEARCH}.vary) == 1")
    assert bench.see(f"{SEARCH}.objective") == "rgb2normal", "which sees brightness"
    bench.enter("objective", "aoap")
    bench.until(f"{SEARCH}.objective == 'aoap'")
    bench.press("optisense.search", across=0.25)
    told = bench.refused()
    assert "aoap" in told, told
    bench.photograph("search-refused")


def test_scores_tell_what_an_edit_changed(bench: Bench) -> None:
    bench.only(EVALUATE)
    bench.tick("coverage")
    bench.press("optisense.evaluate")
    bench.until(f"len({SCORES}) == 1")
    bench.rest()
    camera = bench.see("kinds('CAMERA')[0].name")
    spot = f"on_screen(bpy.data.objects[{camera!r}].matrix_world.translation)"
    bench.desktop.click(*bench.see(spot))
    bench.until(f"bpy.context.view_layer.objects.active.name == {camera!r}")
    bench.desktop.keys("g", "z", "5", "Return")
    bench.press("optisense.evaluate")
    bench.until(f"{SCORES}[0].change.endswith('worse')")
    bench.rest()
    bench.photograph("score-changed")


def test_the_light_is_accounted_for(bench: Bench) -> None:
    bench.press("optisense.ledger")
    bench.until("bool(manager.optisense_ledger.groups)")
    bench.rest()
    bench.bring("optisense.ledger", 0.1)
    bench.photograph("ledger")


def test_markers_are_printed_on_the_skin(bench: Bench) -> None:
    bench.only(MATERIALS)
    bench.select_part("skin", (-6.0, -7.0, 0.0))
    bench.press("optisense.set_markers")
    bench.desktop.keys("Return")
    bench.until("bool(part('looks.markers').of_design(scene()))")
    bench.drawn()
    bench.photograph("markers")


def test_the_tooltip_of_every_control_is_a_sentence(bench: Bench) -> None:
    left, top, width, height = bench.sidebar()
    for panel in range(PANELS):
        bench.only(panel)
        for across in COLUMNS:
            x = round(left + width * across)
            bench.see(f"scan {x} {top + 6} {top + height - 6} {ROW} nothing")
    found = bench.see("tips")
    ours = {name: text for name, text in found.items() if name.startswith("optisense")}
    assert len(ours) >= CONTROLS, ours
    bad = {
        name: text
        for name, text in ours.items()
        if " " not in text or "_" in text.replace(PACKAGE, "")
    }
    assert not bad
    index = next(name for name in found if name.endswith("light_group_index"))
    assert "selects its lights" in found[index]
