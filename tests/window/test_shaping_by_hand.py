"""A cage, a contact and a simulation that is given up, all by mouse and keys.

The steps build on one another, as a user's do.
"""

from __future__ import annotations

import pytest

from .bench import Bench

CAGE = "part('scene.cages').cage_data(kinds('CAGE')[0])"
SELECTED = "sorted(each.name for each in scene().objects if each.select_get())"
SKIN = "max(v.co.z for v in bpy.data.objects['skin'].data.vertices)"
GEL = "max(v.co.z for v in bpy.data.objects['gel'].data.vertices)"
TOP = "float(max(p[2] for p in part('scene.cages').shown_points(kinds('CAGE')[0])))"
MIDDLE = f"on_screen((0.0, 0.0, {TOP}))"
CONTACTS = (
    "[list(each.evaluated_get(bpy.context.evaluated_depsgraph_get()).matrix_world.translation)"
    " for each in kinds('CONTACT')]"
)

LAST = 0.88
"""How far across the sidebar a small button at the end of a row of a box is; of no box, 0.9."""

ON_SKIN, ON_GEL = (-6.0, -7.0, 0.0), (12.625, -5.0, -3.2)
"""mm, places that the view shows: on the skin, and on the side of the gel below it."""

LIFTED = 2.0
"""Distance (mm) by which the middle point of the cage's top is lifted; the middle of the skin rises
by a quarter of it."""

PLACE = (4.0, 3.0, 0.0)
"""Position (mm) of a contact."""


def see_soon(bench: Bench, expression: str, wanted: float) -> None:
    """Wait for a number, such as a height that follows a cage."""
    bench.until(f"abs({expression} - {wanted}) < 1e-4")


def test_a_new_mini(bench: Bench) -> None:
    bench.greet()
    bench.open_tab()
    bench.new_sensor("gelsight-mini-ideal")


def test_a_cage_around_the_skin_alone_is_told(bench: Bench) -> None:
    bench.select_part("skin", ON_SKIN)
    bench.press("optisense.remove_cage", across=LAST)
    bench.until("not kinds('CAGE')")
    bench.press("optisense.new_cage")
    bench.until("len(kinds('CAGE')) == 1")
    (told,) = bench.until("part('shapes.cage_warnings').warnings_of(scene(), 'skin')")
    assert "'gel'" in told["message"] and told["hint"] == "Put 'gel' into the cage too"
    bench.bring("optisense.remove_cage", 0.7, across=LAST)
    bench.photograph("cage-of-skin-alone")
    bench.press("optisense.remove_cage", across=LAST)
    bench.until("not kinds('CAGE')")


def test_a_cage_is_made_around_two_parts(bench: Bench) -> None:
    bench.select_part("skin", ON_SKIN)
    bench.select_part("gel", ON_GEL, too=True)
    assert bench.see(SELECTED) == ["gel", "skin"]
    bench.press("optisense.new_cage")
    bench.until("len(kinds('CAGE')) == 1")
    assert sorted(bench.see(f"{CAGE}['parts']")) == ["gel", "skin"]
    assert bench.see(f"{CAGE}['resolution']") == [3, 3, 3]
    bench.until("not part('shapes.cage_warnings').warnings_of(scene(), 'skin')")


def test_parts_follow_a_point_while_it_moves(bench: Bench) -> None:
    bench.press("optisense.set_bound", across=0.25)
    bench.until(f"bool({CAGE}.get('c_min'))")
    bench.press("optisense.edit_shape")
    bench.until("bpy.context.mode == 'EDIT_MESH'")
    bench.desktop.click(*bench.see(MIDDLE))
    bench.see("1")
    bench.desktop.keys("g", "z", *f"{LIFTED:g}")
    see_soon(bench, TOP, LIFTED)
    see_soon(bench, SKIN, LIFTED / 4)
    see_soon(bench, GEL, LIFTED / 4)
    bench.photograph("cage")
    bench.desktop.keys("Return")
    bench.see("1")
    bench.drawn()
    bench.desktop.keys("ctrl+z")
    see_soon(bench, SKIN, 0.0)
    bench.desktop.keys("ctrl+shift+z")
    see_soon(bench, SKIN, LIFTED / 4)


def test_a_blend_of_two_shapes_can_be_undone(bench: Bench) -> None:
    bench.press("optisense.set_bound", across=0.75)
    bench.until(f"bool({CAGE}.get('c_max'))")
    assert bench.see("bpy.context.mode") == "OBJECT"
    bench.press("optisense.blend")
    bench.until(f"{CAGE}.get('blend') == 1.0")
    see_soon(bench, SKIN, LIFTED / 4)
    bench.enter("blend", "0.5")
    see_soon(bench, SKIN, LIFTED / 8)
    left, top, width, height = bench.see("place('VIEW_3D', 'WINDOW')")
    bench.desktop.move(left + width * 0.3, top + height - 60)
    for height, blend in ((LIFTED / 4, 1.0), (LIFTED / 4, None)):
        bench.desktop.keys("ctrl+z")
        bench.until(f"{CAGE}.get('blend') == {blend}")
        see_soon(bench, SKIN, height)
    bench.desktop.keys("ctrl+z")
    bench.until(f"not {CAGE}.get('c_max')")
    for height in (LIFTED / 4, LIFTED / 4, LIFTED / 8):
        bench.desktop.keys("ctrl+shift+z")
        see_soon(bench, SKIN, height)
        bench.drawn()
    bench.until(f"{CAGE}.get('blend') == 0.5")
    assert bench.see("kinds('CAGE')[0].optisense.blend") == 0.5


def test_a_contact_is_placed_by_a_click(bench: Bench) -> None:
    bench.press("optisense.place_contact", across=0.25)
    bench.see("1")
    bench.desktop.click(*bench.see("on_screen((0.0, 0.0, 12.0))"))  # beside the sensor
    bench.see("1")
    assert not bench.see("kinds('CONTACT')")
    x, y = bench.see(f"on_screen({PLACE})")
    bench.desktop.click(x, y)
    bench.until("len(kinds('CONTACT')) == 1")
    (point,) = bench.see(CONTACTS)
    where = bench.see(f"on_screen({point})")
    assert where == pytest.approx([x, y], abs=2.0), "pixels: it is where the click was"
    assert bench.see(SELECTED) == ["contact"]
    bench.desktop.keys("ctrl+z")
    bench.until("not kinds('CONTACT')")
    bench.desktop.keys("ctrl+shift+z")
    bench.until("len(kinds('CONTACT')) == 1")


def test_a_simulation_is_given_up(bench: Bench) -> None:
    bench.press("optisense.simulate")
    bench.until("state().busy == 'Simulating'")
    bench.press("optisense.cancel", across=0.9)
    bench.rest()
    assert bench.see("state().note") == "Cancelled"
    assert bench.see("manager.optisense_picture.is_draft"), "that of the opened sensor"
    assert len(bench.see(CONTACTS)) == 1
    bench.press("optisense.simulate")
    bench.until("not manager.optisense_picture.is_draft")
    bench.rest()
