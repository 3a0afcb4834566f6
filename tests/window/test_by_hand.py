"""From a new Mini to a better one that is saved and opened again, all by mouse and keys.

The steps build on one another, as a user's do; pictures of them go to the folder that
OPTISENSE_WINDOW_PICTURES names.
"""

from __future__ import annotations

import numpy as np
import pytest
import yaml

from .bench import TRIES, Bench

DRAFT = "manager.optisense_picture.is_draft"

MOVED = 1.5
"""Distance (mm) by which a light is moved."""

SENSOR, LIGHTS, SIMULATE, EVALUATE, OPTIMISE, REPORT = 0, 3, 4, 5, 6, 7
"""Places of panels in the sidebar; the first is 0."""

VARY = 'wm.call_menu(name="OPTISENSE_MT_vary")'
"""The button *Vary*."""

FIRST_ROW = 37
"""Pixels from the top of the button *Vary* to the middle of the first row of the list below it."""

ABOVE_BUTTON = 60
"""Pixels from the button that draws the materials up to the picture of the chosen one."""

LAST_PICTURE = (222, 114)
"""Pixels from there to the left and up: a picture in the last row of those to choose from."""

EDITOR_FITS = "area('IMAGE_EDITOR').spaces.active.zoom[0] != 1.0"
"""An Image Editor has been told to show its picture whole."""

PICTURE_FITS = (
    "(lambda r: 0.8 < max((r.view2d.view_to_region(1, 1, clip=False)[i]"
    " - r.view2d.view_to_region(0, 0, clip=False)[i]) / (r.width, r.height)[i]"
    " for i in (0, 1)) <= 1.0)(region('IMAGE_EDITOR', 'WINDOW'))"
)
"""The picture fills an Image Editor in one direction and is whole in both."""

WIDER = 150
"""Pixels by which the picture's editor is made wider."""

SELECTED = (71, 114, 179)
"""The colour of what is pressed or full in Blender's theme."""

CORNERS_ACROSS = (
    "on_screen(each.matrix_world @ Vector(corner))[0]"
    " for each in kinds('PART') for corner in each.bound_box"
)
"""Where corners of parts are in the window, pixels from its left."""

FIELDS_OF_VIEW = (50.0, 60.0, 70.0)
"""Degrees, what the search tries; all see less than the whole surface or beyond its edge."""


def test_the_tab_is_there(bench: Bench) -> None:
    bench.greet()
    bench.open_tab()
    bench.find("optisense.open", across=0.25)
    with pytest.raises(AssertionError, match=r"are: .*optisense\.open"):
        bench.find("optisense.ope", across=0.25)  # names are whole, and what there is, is told


def test_a_new_mini(bench: Bench) -> None:
    bench.new_sensor("gelsight-mini-ideal", panels=False)
    assert bench.see("scene().optisense.title") == "gelsight-mini-ideal"
    assert len(bench.see("[light.name for light in kinds('LIGHT')]")) == 15
    bench.drawn()
    right = bench.see(f"max({CORNERS_ACROSS})")
    assert right < bench.sidebar()[0], "the sensor is not hidden by the sidebar"
    bench.until(f"manager.optisense_picture.shown and {DRAFT}")  # nobody asked for it
    bench.only(SIMULATE)
    bench.press("optisense.add_contact", across=0.75)
    bench.until("len(kinds('CONTACT')) == 1")
    bench.photograph("1-new-mini")


def test_a_light_is_moved(bench: Bench) -> None:
    for name in bench.see("[light.name for light in kinds('LIGHT')]"):
        spot = bench.see(f"on_screen(bpy.data.objects[{name!r}].matrix_world.translation)")
        bench.desktop.click(*spot)
        bench.see("1")
        if bench.see("bpy.context.view_layer.objects.active.name") == name:
            break
    else:
        raise AssertionError("no light can be clicked on")
    before = bench.see(f"list(bpy.data.objects[{name!r}].location)")
    bench.desktop.keys("g", "z", "minus", *(str(MOVED).replace(".", " period ").split()), "Return")
    bench.until(f"bpy.data.objects[{name!r}].location.z < {before[2] - 0.1}")
    after = bench.see(f"list(bpy.data.objects[{name!r}].location)")
    assert after == pytest.approx([before[0], before[1], before[2] - MOVED], abs=1e-4)
    bench.photograph("2-light-moved")


def test_a_material_is_chosen_from_pictures(bench: Bench) -> None:
    bench.open_all()  # so that the sidebar can be scrolled, and the pictures have room
    before = bench.see("manager.optisense_material.material")
    bench.press("optisense.material_pictures", across=0.9)
    bench.until("part('materials.gallery').is_begun('material')")
    bench.until("part('materials.gallery').waiting('material') == 0")
    _, y = bench.bring("optisense.material_pictures", 0.7, across=0.9)
    left, _, width, _ = bench.sidebar()
    middle = left + width / 2
    bench.desktop.click(middle, y - ABOVE_BUTTON)
    bench.see("1")
    bench.drawn()
    bench.photograph("materials")
    bench.desktop.click(middle - LAST_PICTURE[0], y - ABOVE_BUTTON - LAST_PICTURE[1])
    bench.until(f"manager.optisense_material.material != {before!r}")


def test_a_picture_appears(bench: Bench) -> None:
    bench.only(SIMULATE)
    bench.press("optisense.simulate")
    bench.until(f"state().busy == 'Simulating' or not {DRAFT}")
    bench.rest()
    assert bench.see("manager.optisense_picture.shown and not manager.optisense_picture.is_draft")
    width, height = bench.see("list(bpy.data.images['OptiSense picture'].size)")
    assert (width, height) == (320, 240)
    red, green, blue = bench.see(
        "[sum(list(bpy.data.images['OptiSense picture'].pixels)[c::4]) for c in range(3)]"
    )
    assert min(red, green, blue) > 0.05 * width * height
    bench.drawn()  # the mouse still rests on the button
    left, top, across, height = bench.sidebar()
    panels = np.asarray(bench.desktop.shown().crop((left, top, left + across, top + height)))
    blue = (abs(panels.astype(int) - SELECTED) < 12).all(axis=2)
    assert blue.mean() < 0.05, "the panel shows the picture, and not a full bar"
    bench.bring("optisense.show_picture", 0.95)
    bench.photograph("3-picture")


def test_scores_appear(bench: Bench) -> None:
    bench.only(EVALUATE)
    for name in ("aoap", "2to3pw"):
        bench.tick(name)
    bench.until("manager.optisense_evaluation.chosen == {'aoap', '2to3pw'}")
    bench.press("optisense.evaluate")
    bench.until("len(manager.optisense_evaluation.scores) == 2")
    bench.rest()
    scores = bench.see("{s.name: float(s.value) for s in manager.optisense_evaluation.scores}")
    assert 0.5 < scores["aoap"] <= 1.01 and scores["2to3pw"] > 0.0, scores
    assert not bench.see("any(s.is_open for s in manager.optisense_evaluation.scores)")
    bench.press("is_open", across=0.09)
    bench.until("manager.optisense_evaluation.scores[0].is_open")
    bench.press("optisense.show_figure")
    bench.until("any(each.type == 'IMAGE_EDITOR' for each in window().screen.areas)")
    figure = "area('IMAGE_EDITOR').spaces.active.image"
    bench.until(f"{figure} is not None and {figure}.name.startswith('OptiSense figure')")
    assert min(bench.see(f"list({figure}.size)")) >= 400
    bench.until(f"{EDITOR_FITS}")
    bench.photograph("figure")
    bench.see("close_area('IMAGE_EDITOR')")
    bench.press("optisense.show_rays", across=0.25)
    bench.until("any(each.optisense.key == 'ray hit' for each in scene().objects)")
    bench.rest()
    bench.bring("optisense.show_rays", 0.95, across=0.25)
    bench.photograph("4-evaluated")


def test_it_is_saved(bench: Bench) -> None:
    bench.only(SENSOR)
    bench.press("optisense.save_as", across=0.85)
    bench.choose_file()
    bench.until("scene().optisense.is_saved")
    bench.rest()
    written = yaml.safe_load((bench.home / "gelsight-mini-ideal" / "design.yaml").read_text())
    assert len(written["lights"]) == 3


def test_a_small_grid_finds_the_best_of_three(bench: Bench) -> None:
    bench.only(EVALUATE)
    bench.press("optisense.hide_rays", across=0.75)
    bench.until("not kinds('SHOWN')")
    camera = bench.see("kinds('CAMERA')[0].name")
    bench.desktop.click(*bench.see(f"on_screen(bpy.data.objects[{camera!r}].matrix_world"
                                   ".translation)"))  # fmt: skip
    bench.until(f"bpy.context.view_layer.objects.active.name == {camera!r}")
    bench.only(OPTIMISE)
    labels = bench.see("[each.label for each in part('core.search_parameters').for_camera()]")
    bench.choose(bench.bring(VARY, 0.3), labels.index("Field of view"))
    bench.until("len(scene().optisense_search.vary) == 1")
    grid = "camera.fov=" + ",".join(f"{each:g}" for each in FIELDS_OF_VIEW)
    x, y = bench.find(VARY)
    bench.enter_at((x, y + FIRST_ROW), grid, times=2)
    bench.until(f"scene().optisense_search.vary[0].text == {grid!r}")
    bench.enter("method", "grid")
    bench.until("scene().optisense_search.method == 'grid'")
    bench.press("optisense.search", across=0.25)
    bench.until("state().busy == 'Searching'")
    bench.rest()
    assert "3 trials" in bench.see("manager.optisense_found.ended")
    bench.bring("optisense.apply_best", 0.95, across=0.25)
    bench.photograph("5-searched")


def test_the_best_is_applied_saved_and_opened_again(bench: Bench) -> None:
    best = float(bench.see("manager.optisense_found.values").rpartition("=")[2])
    assert best in FIELDS_OF_VIEW
    before = bench.see("kinds('CAMERA')[0].optisense.fov")
    bench.press("optisense.apply_best", across=0.25)
    bench.until("not state().busy and abs(kinds('CAMERA')[0].optisense.fov - "
                f"{before}) > 1e-3")  # fmt: skip
    assert bench.see("kinds('CAMERA')[0].optisense.fov") == pytest.approx(best, abs=1e-4)
    bench.only(SENSOR)
    bench.press("optisense.save")
    bench.until("'Saved in' in state().note")
    folder = bench.home / "gelsight-mini-ideal"
    written = yaml.safe_load((folder / "design.yaml").read_text())
    assert written["camera"]["fov"] == best
    bench.press("optisense.open", across=0.25)
    bench.choose_file("design.yaml")
    bench.until("not state().busy")
    assert not bench.see("state().problem"), bench.said()
    assert bench.see("scene().optisense.folder") == str(folder)
    assert bench.see("kinds('CAMERA')[0].optisense.fov") == pytest.approx(best, abs=1e-4)
    heights = sorted(bench.see("[each.location.z for each in kinds('LIGHT')]"))
    assert heights == pytest.approx([heights[-1] - MOVED, *[heights[-1]] * 14], abs=1e-3)
    bench.until(f"{DRAFT} and not manager.optisense_picture.is_before")
    bench.only(SIMULATE)
    bench.press("optisense.simulate")
    bench.until("not manager.optisense_picture.is_draft")
    bench.rest()
    bench.press("optisense.show_picture")
    bench.until("any(each.type == 'IMAGE_EDITOR' for each in window().screen.areas)")
    bench.photograph("6-opened-again")


def test_a_report_and_files_for_workshop_and_robot_are_written(bench: Bench) -> None:
    bench.only(REPORT)
    bench.photograph("7-report")
    bench.press("optisense.report")
    bench.choose_file()
    bench.until("'Written to' in state().note")
    page = (bench.home / "gelsight-mini-ideal.html").read_text(encoding="utf-8")
    assert page.count("data:image/png;base64,") >= 2 and "gelsight-mini-ideal" in page
    bench.press("optisense.export")
    bench.choose_file()
    bench.until("'files in' in state().note")
    written = bench.home / "gelsight-mini-ideal-workshop"
    assert {"gel.stl", "skin.stl"} <= {each.name for each in written.rglob("*.stl")}
    bench.press("optisense.export_robot")
    bench.choose_file()
    bench.until("'-robot' in state().note")
    robot = bench.home / "gelsight-mini-ideal-robot"
    assert {"gelsight-mini-ideal.xml", "gelsight-mini-ideal.urdf"} <= {
        each.name for each in robot.iterdir()
    }


def test_a_click_on_a_group_selects_its_lights(bench: Bench) -> None:
    bench.only(LIGHTS)
    _, y = bench.find("flux", across=0.6)  # of the first group; its name is further left
    left, _, width, _ = bench.sidebar()
    bench.desktop.click(left + 0.2 * width, y + 22)
    chosen = "[each.optisense.group for each in scene().objects if each.select_get()]"
    second = bench.see("scene().optisense.light_groups[1].name")
    bench.until(f"set({chosen}) == {{{second!r}}}")
    assert len(bench.see(chosen)) == 5


def test_the_workspace_shows_the_picture_whole(bench: Bench) -> None:
    bench.only(SENSOR)
    bench.press("optisense.workspace")
    bench.until("window().workspace.name == 'OptiSense'")
    bench.until("sorted(a.type for a in window().screen.areas) == ['IMAGE_EDITOR', 'VIEW_3D']")
    bench.until("region('VIEW_3D', 'UI').active_panel_category == 'OptiSense'")
    editor = "area('IMAGE_EDITOR').spaces.active"
    bench.until(f"{editor}.image is not None")
    bench.only(SIMULATE)
    bench.press("optisense.simulate")
    bench.until("state().busy == 'Simulating' or not manager.optisense_picture.is_before")
    bench.rest()
    bench.until(PICTURE_FITS)
    left, top, _, height = bench.see("place('IMAGE_EDITOR', 'WINDOW')")
    for _ in range(TRIES):  # a hand may miss the edge, which is two pixels wide
        bench.drag((left - 1, top + height / 2), (left - WIDER, top + height / 2))
        if bench.see(f"place('IMAGE_EDITOR', 'WINDOW')[0] < {left - WIDER / 2}"):
            break
    assert bench.see(f"place('IMAGE_EDITOR', 'WINDOW')[0] < {left - WIDER / 2}")
    bench.until(PICTURE_FITS)
    bench.photograph("workspace-wide")
