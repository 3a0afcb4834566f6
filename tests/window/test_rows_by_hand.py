"""The tour, rows of lights as a whole, and a skin that is made in one press, by mouse and keys.

The steps build on one another, as a user's do.
"""

from __future__ import annotations

import numpy as np
import pytest

from .bench import Bench
from .test_by_hand import LIGHTS, SIMULATE

EVALUATE = 5
"""The panel's place in the sidebar; the first is 0."""

STEP = "part('sensor.tour').step_now(bpy.context)"

ROW = 1
"""The group whose row is moved: the second of the list."""

NAME, EYE, STAR = 0.2, 0.77, 0.86
"""Where the name, the eye and the star of a group are in the list, 0 is the sidebar's left edge."""

LINE = 22
"""Pixels from one group of the list to the next."""

LIGHTS_OF = "part('lights.group_selection').lights_of(scene(), {!r})"
POSES = f"[part('scene.lamps').light_pose(each) for each in {LIGHTS_OF}]"

ARROW = (
    "(lambda f, v, s: [on_screen(f.translation - f.to_3x3().col[2] * share * 75.0 * s"
    " / (Vector(on_screen(f.translation + v)) - Vector(on_screen(f.translation))).length)"
    " for share in (0.0, 0.9, 1.4)])"
    "(part('lights.row_gizmo').frame({lights}),"
    " area('VIEW_3D').spaces.active.region_3d.view_rotation @ Vector((1.0, 0.0, 0.0)),"
    " part('lights.row_gizmo').LENGTH * bpy.context.preferences.system.ui_scale)"
)
"""Where the arrow along the light of a row begins, nearly ends, and a place beyond, in pixels; not
seen at a slant, it is 75 pixels times its length long."""

COUNT, PITCH = 3, 2.5
"""Number of lights of the row that is arranged, and their distance in mm."""

TO_FIELD, FIELD = (50, 9), 23
"""Pixels from the button *Arrange Row*, to the left and down, to the first field of its dialog,
which opens with that field under the pointer; and from one field to the next."""

SKIN, GEL = (-6.0, -7.0, 0.0), (12.625, -5.0, -3.2)
"""mm: on the skin, and on the side of the gel below it, where nothing hides them."""


def test_the_tour_leads_to_a_picture_and_its_score(bench: Bench) -> None:
    bench.greet()
    bench.open_tab()
    bench.press("optisense.tour")
    assert bench.see(STEP) == 0
    bench.new_sensor("gelsight-mini-ideal")
    bench.until(f"{STEP} == 1")
    bench.only(SIMULATE)
    bench.press("optisense.add_contact", across=0.75)
    bench.until(f"{STEP} == 2")
    bench.press("optisense.simulate")
    bench.until(f"{STEP} == 3")
    bench.rest()
    bench.enter_at(bench.find("flux"), "3")
    bench.until(f"{STEP} == 4")
    bench.only(EVALUATE)
    bench.tick("aoap")
    bench.press("optisense.evaluate")
    bench.until(f"{STEP} == 5")
    bench.rest()
    bench.only(0)
    bench.photograph("tour")
    bench.press("optisense.tour", across=0.9)
    bench.until("not manager.optisense_tour.is_on")


def test_a_row_is_selected_and_moved_by_its_gizmo(bench: Bench) -> None:
    group = bench.see(f"scene().optisense.light_groups[{ROW}].name")
    bench.only(LIGHTS)
    _, y = bench.find("flux", across=0.6)
    left, _, width, _ = bench.sidebar()
    bench.desktop.click(left + NAME * width, y + ROW * LINE)
    bench.until(f"all(each.select_get() for each in {LIGHTS_OF.format(group)})")
    bench.drawn()
    before = bench.see(POSES.format(group))
    lights = LIGHTS_OF.format(group)
    _, start, end = bench.see(ARROW.replace("{lights}", lights))
    bench.photograph("row", "WINDOW")
    bench.drag(start, end)
    bench.until(f"{POSES.format(group)}[0] != {before[0]!r}")
    after = bench.see(POSES.format(group))
    shifts = np.array([p["position"] for p in after]) - [p["position"] for p in before]
    assert shifts == pytest.approx(np.tile(shifts[0], (len(shifts), 1)), abs=1e-3)
    length = np.linalg.norm(shifts[0])
    assert length > 0.1
    assert shifts[0] / length == pytest.approx(before[0]["direction"], abs=1e-2)
    bench.desktop.keys("ctrl+z")
    bench.until(f"abs({POSES.format(group)}[0]['position'][0] - {before[0]['position'][0]})"
                " < 1e-3")  # fmt: skip


def test_a_row_is_snapped_to_an_edge_hidden_and_shown_alone(bench: Bench) -> None:
    group = bench.see(f"scene().optisense.light_groups[{ROW}].name")
    before = bench.see(POSES.format(group))
    bench.press("optisense.snap_row", across=0.25)
    bench.until(f"{POSES.format(group)}[0] != {before[0]!r}")
    bench.photograph("row-snapped")
    bench.over_view()
    bench.desktop.keys("ctrl+z")
    _, y = bench.find("flux", across=0.6)
    left, _, width, _ = bench.sidebar()
    bench.desktop.click(left + EYE * width, y + ROW * LINE)
    bench.until(f"not any(each.visible_get() for each in {LIGHTS_OF.format(group)})")
    bench.desktop.click(left + STAR * width, y + ROW * LINE)
    bench.until(f"[g.name for g in scene().optisense.light_groups if g.shown] == [{group!r}]")
    bench.desktop.click(left + STAR * width, y + ROW * LINE)
    bench.until("all(g.shown for g in scene().optisense.light_groups)")


def test_a_row_is_given_another_count_and_pitch(bench: Bench) -> None:
    group = bench.see(f"scene().optisense.light_groups[{ROW}].name")
    before = np.array([each["position"] for each in bench.see(POSES.format(group))])
    x, y = bench.find("optisense.arrange_row", across=0.25)
    bench.desktop.click(x, y)
    bench.drawn()
    bench.enter_at((x - TO_FIELD[0], y + TO_FIELD[1]), str(COUNT), times=1)
    bench.desktop.click(x - TO_FIELD[0], y + TO_FIELD[1] + FIELD)
    bench.see("1")
    bench.desktop.keys("ctrl+a")
    bench.desktop.write(f"{PITCH:g}")
    bench.desktop.keys("Return")
    bench.drawn()
    bench.photograph("row-asked")
    bench.desktop.keys("Return")  # OK
    bench.until(f"len({LIGHTS_OF.format(group)}) == {COUNT}")
    after = np.array([each["position"] for each in bench.see(POSES.format(group))])
    steps = np.linalg.norm(np.diff(after, axis=0), axis=1)
    assert steps == pytest.approx(np.full(COUNT - 1, PITCH), abs=1e-4)
    assert after.mean(axis=0) == pytest.approx(before.mean(axis=0), abs=1e-4)
    assert bench.see(f"all(each.select_get() for each in {LIGHTS_OF.format(group)})")
    bench.over_view()
    bench.desktop.keys("ctrl+z")
    bench.until(f"len({LIGHTS_OF.format(group)}) == {len(before)}")


def test_a_skin_is_made_in_one_press(bench: Bench) -> None:
    bench.only(1)
    bench.select_part("skin", SKIN)
    bench.desktop.keys("Delete")
    bench.until("not any(p.optisense.role == 'sensing_surface' for p in kinds('PART'))")
    bench.select_part("gel", GEL)
    bench.press("optisense.make_skin")
    bench.until("any(p.optisense.role == 'sensing_surface' for p in kinds('PART'))")
    assert bench.see("bpy.context.view_layer.objects.active.optisense.is_caged"), "as its gel is"
    bench.photograph("skin-made")
