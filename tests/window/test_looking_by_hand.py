"""The workspace that the command opens: section, footprint, drafts, and the comparison with a
pinned picture, by mouse and keys.

The steps build on one another, as a user's do.
"""

from __future__ import annotations

import numpy as np
import pytest

from .bench import Bench
from .test_by_hand import LIGHTS, SIMULATE

LOOKS = "scene().optisense_looks"
VIEW = "manager.optisense_view"
PICTURE = "manager.optisense_picture"
TOLD = "part('looks.footprint').in_words(scene())"
SHOWN = "area('IMAGE_EDITOR').spaces.active.image"
SIZE = "list(bpy.data.images['OptiSense picture'].size)"

RED = (
    "(lambda p, w: [sum(p[k] for k in range(0, len(p), 4) if (k // 4 % w < w // 2) == side)"
    " / sum(p[k] for k in range(1, len(p), 4) if (k // 4 % w < w // 2) == side)"
    f" for side in (True, False)])(list({SHOWN}.pixels), {SHOWN}.size[0])"
)
"""Red light relative to green light in the left and in the right half of the picture shown."""

DIFFERENT = 1.1
"""Least ratio of red to green in a difference of pictures where only red light was added; grey is
1."""

HELP = {LIGHTS: ("studio", "4 Lights and Camera."), SIMULATE: ("studio", "5 Simulate.")}
"""Pages of help, and the words at which they open, for some panels."""

HELP_BUTTON = {LIGHTS: 0.85, SIMULATE: 0.77}
"""Where the question mark is in the head of a panel, 0 is the sidebar's left edge."""

TEXT = "area('TEXT_EDITOR').spaces.active"
CLOSED = (
    "[c.__exit__(None, None, None) for c in [bpy.context.temp_override(window=manager.windows[1])]"
    " if (c.__enter__(), bpy.ops.wm.window_close())]"
)

CHANGED = 0.02
"""Share of the view's pixels that a section or a footprint changes at least."""


def changed(before: np.ndarray, after: np.ndarray) -> float:
    """The share of pixels that two pictures of the view differ in."""
    return float((abs(after - before).max(axis=2) > 16).mean())


def test_the_command_shows_a_design_in_the_workspace(bench: Bench) -> None:
    bench.close()
    bench.start(design="gelsight-mini-ideal")
    bench.until("window().workspace.name == 'OptiSense'")
    bench.until("sorted(a.type for a in window().screen.areas) == ['IMAGE_EDITOR', 'VIEW_3D']")
    bench.until("scene().optisense.is_open and not state().busy")
    bench.until("region('VIEW_3D', 'UI').active_panel_category == 'OptiSense'")
    bench.photograph("by-command")


def test_a_slider_cuts_the_sensor_open(bench: Bench) -> None:
    bench.only(0)
    bench.over_view()
    whole = bench.view()
    bench.press("cut", across=0.2)
    bench.until(f"{LOOKS}.cut")
    bench.over_view()
    half = bench.view()
    assert changed(whole, half) > CHANGED
    bench.photograph("section")
    bench.enter("share", "0.8")
    bench.until(f"abs({LOOKS}.share - 0.8) < 1e-3")
    bench.over_view()
    assert changed(half, bench.view()) > CHANGED
    bench.press("cut", across=0.2)
    bench.until(f"not {LOOKS}.cut")
    bench.over_view()
    assert changed(whole, bench.view()) < CHANGED / 10


def test_the_footprint_follows_the_camera(bench: Bench) -> None:
    bench.press("footprint", across=0.1)
    bench.until(f"'The camera sees' in {TOLD}")
    before = bench.see(TOLD)
    camera = bench.see("kinds('CAMERA')[0].name")
    spot = f"on_screen(bpy.data.objects[{camera!r}].matrix_world.translation)"
    bench.desktop.click(*bench.see(spot))
    bench.until(f"bpy.context.view_layer.objects.active.name == {camera!r}")
    bench.desktop.keys("g", "z", "1", "0", "Return")
    bench.until(f"'The camera sees' in {TOLD} and {TOLD} != {before!r}")
    bench.photograph("footprint-near")
    bench.over_view()
    bench.desktop.keys("ctrl+z")
    bench.until(f"{TOLD} == {before!r}")
    bench.press("footprint", across=0.1)
    bench.until(f"not {LOOKS}.footprint")


def test_a_draft_has_the_size_of_the_picture(bench: Bench) -> None:
    bench.only(SIMULATE)
    bench.press("optisense.add_contact", across=0.75)
    bench.until("len(kinds('CONTACT')) == 1")
    bench.press("optisense.simulate")
    bench.until(f"{PICTURE}.shown and not {PICTURE}.is_draft")
    bench.rest()
    size = bench.see(SIZE)
    bench.press("draft", across=0.1)
    bench.until("scene().optisense_simulation.draft")
    bench.until(f"{PICTURE}.is_draft")
    bench.desktop.click(*bench.see("on_screen(kinds('LIGHT')[0].matrix_world.translation)"))
    bench.until("bpy.context.view_layer.objects.active.optisense.kind == 'LIGHT'")
    summary = bench.see(f"{PICTURE}.file")
    bench.desktop.keys("g", "z", "minus", "1", "Return")
    bench.until(f"{PICTURE}.is_draft")
    assert bench.see(SIZE) == size, summary
    bench.photograph("draft")
    bench.press("draft", across=0.1)
    bench.until("not scene().optisense_simulation.draft")
    bench.press("optisense.simulate")
    bench.until(f"not {PICTURE}.is_draft")
    bench.rest()


def test_a_picture_is_compared_with_a_pinned_one(bench: Bench) -> None:
    plain = bench.see(RED)
    bench.press_above_picture("optisense.pin_picture")
    bench.until(f"{VIEW}.pinned and {VIEW}.compare == 'WIPE'")
    bench.only(LIGHTS)
    bench.enter_at(bench.find("flux", across=0.6), "6")
    bench.until(f"{PICTURE}.is_relit")
    bench.photograph("workspace")
    wiped = bench.see(RED)
    assert wiped[0] == pytest.approx(plain[0], rel=0.02), "the pinned picture is on the left"
    assert wiped[1] > 1.2 * plain[1], "more red light on the right, where the new picture is"
    bench.press_above_picture("compare", 2)
    bench.until(f"{VIEW}.compare == 'DIFFERENCE'")
    bench.photograph("difference")
    left, right = bench.see(RED)
    assert min(left, right) > DIFFERENT, "more red light everywhere, and no more green light"
    assert bench.see(f"min(list({SHOWN}.pixels)[1::4])") == pytest.approx(0.5, abs=0.02), (
        "grey: as before"
    )
    bench.press_above_picture("compare")
    bench.until(f"{VIEW}.compare == 'NONE'")
    bench.press_above_picture("false_colour")
    bench.until(f"{VIEW}.false_colour")
    bench.photograph("false-colours")
    bench.press_above_picture("false_colour")
    bench.press_above_picture("optisense.unpin_picture")
    bench.until(f"not {VIEW}.pinned and not {VIEW}.false_colour")
    assert bench.see(f"{SHOWN}.name") == "OptiSense picture"


def test_the_question_mark_opens_the_page_at_its_panel(bench: Bench) -> None:
    for panel, (page, begins) in HELP.items():
        bench.only(panel)
        topic = begins.partition(" ")[2].rstrip(".")
        bench.press(f'optisense.help(topic="{topic}")', across=HELP_BUTTON[panel])
        bench.until("any(a.type == 'TEXT_EDITOR' for w in manager.windows for a in w.screen.areas)")
        bench.until(f"{TEXT}.text.name == 'OptiSense help: {page}'")
        shown = f"[line.body for line in {TEXT}.text.lines[{TEXT}.top:{TEXT}.top + 4]]"
        bench.until(f"any(line.startswith({begins!r}) for line in {shown})")
        bench.photograph(f"help-{page}-{panel}")
        bench.see(CLOSED)
        bench.until("len(manager.windows) == 1")
