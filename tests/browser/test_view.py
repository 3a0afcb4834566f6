"""The 3-D view of a page turns, zooms, moves, cuts and hides by mouse, touch and keys."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Browser, Locator

from .conftest import opening
from .visit import Visit

CANVAS = "3-D view of the sensor"
SIZE = (640, 600)
"""Pixels of the window; the processor draws all of them anew whenever the view changes."""


@pytest.fixture(scope="module")
def window(browser: Browser, pages: dict[str, Path]) -> Iterator[Visit]:
    with opening(browser) as open_page:
        yield open_page(pages["ledger"], SIZE, has_touch=True)


@pytest.fixture
def view(window: Visit) -> Visit:
    """The window that these tests share; the sensor is whole, and seen from its corner."""
    window.page.get_by_role("button", name="Corner").click()
    assert window.page.get_by_label("axis of the cut").input_value() == "-1"
    return window


def canvas(view: Visit) -> Locator:
    found = view.page.get_by_label(CANVAS)
    found.scroll_into_view_if_needed()
    return found


def middle(view: Visit) -> tuple[float, float]:
    box = canvas(view).bounding_box()
    assert box
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


def changed(one: np.ndarray, other: np.ndarray) -> float:
    """The share of pixels that differ by more than 8 grey levels."""
    return float((np.abs(one - other).max(axis=2) > 8).mean())


def drag(view: Visit, dx: float, dy: float, button: str = "left") -> None:
    x, y = middle(view)
    mouse = view.page.mouse
    mouse.move(x, y)
    mouse.down(button=button)
    mouse.move(x + dx, y + dy, steps=4)
    mouse.up(button=button)


def touch(view: Visit, *ways: list[tuple[float, float]]) -> None:
    """Fingers on the screen, each on its way of points from the middle of the view."""
    session = view.page.context.new_cdp_session(view.page)
    x, y = middle(view)

    def send(kind: str, places: list[tuple[float, float]]) -> None:
        points = [{"x": x + dx, "y": y + dy, "id": i} for i, (dx, dy) in enumerate(places)]
        session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    steps = list(zip(*ways, strict=True))
    send("touchStart", list(steps[0]))
    for places in steps[1:]:
        send("touchMove", list(places))
    send("touchEnd", [])


def test_a_drag_turns_and_turns_back(view: Visit) -> None:
    before = view.pixels(canvas(view))
    drag(view, 120, 40)
    turned = view.pixels(canvas(view))
    assert changed(before, turned) > 0.02
    drag(view, -120, -40)
    assert changed(before, view.pixels(canvas(view))) < 0.005


def test_arrow_keys_turn_and_plus_and_minus_zoom(view: Visit) -> None:
    before = view.pixels(canvas(view))
    canvas(view).focus()
    for key, back in (("ArrowLeft", "ArrowRight"), ("ArrowUp", "ArrowDown")):
        for _ in range(4):
            view.page.keyboard.press(key)
        assert changed(before, view.pixels(canvas(view))) > 0.02, key
        for _ in range(4):
            view.page.keyboard.press(back)
        assert changed(before, view.pixels(canvas(view))) < 0.005, back
    for _ in range(3):
        view.page.keyboard.press("+")
    assert drawn_part(view) > 1.1 * ink(before)


def ink(picture: np.ndarray) -> float:
    """The share of pixels darker or more colourful than the background, which is pale grey."""
    return float(((picture.max(axis=2) < 200) | (np.ptp(picture, axis=2) > 25)).mean())


def drawn_part(view: Visit) -> float:
    return ink(view.pixels(canvas(view)))


def test_the_wheel_and_two_fingers_zoom(view: Visit) -> None:
    before = drawn_part(view)
    view.page.mouse.move(*middle(view))
    view.page.mouse.wheel(0, 300)
    assert drawn_part(view) < 0.8 * before
    view.page.get_by_role("button", name="Corner").click()
    assert drawn_part(view) == pytest.approx(before, rel=0.02)
    apart = [(30.0 + 10.0 * i, 0.0) for i in range(6)]
    touch(view, [(-x, y) for x, y in apart], apart)
    assert drawn_part(view) > 1.2 * before


def test_a_finger_turns_and_does_not_scroll(view: Visit) -> None:
    before = view.pixels(canvas(view))
    scrolled = view.page.evaluate("() => window.scrollY")
    touch(view, [(0.0, 0.0), (40.0, 0.0), (80.0, 10.0), (120.0, 20.0)])
    assert changed(before, view.pixels(canvas(view))) > 0.02
    assert view.page.evaluate("() => window.scrollY") == scrolled


def test_the_right_button_moves(view: Visit) -> None:
    """What is at the middle's distance follows the pointer; nearer things run ahead."""
    before = view.pixels(canvas(view))[50:350]
    drag(view, 60, 0, button="right")
    after = view.pixels(canvas(view))[50:350]
    width = before.shape[1] - 120
    misfits = [np.abs(after[:, d : d + width] - before[:, :width]).mean() for d in range(121)]
    assert np.argmin(misfits) == pytest.approx(60, abs=6)


def test_the_cut_takes_a_part_away_by_keys(view: Visit) -> None:
    before = view.pixels(canvas(view))
    view.page.get_by_label("place of the cut").focus()
    for _ in range(10):
        view.page.keyboard.press("ArrowLeft")
    assert view.page.get_by_label("axis of the cut").input_value() == "1"
    cut = view.pixels(canvas(view))
    assert changed(before, cut) > 0.02
    view.page.get_by_label("axis of the cut").select_option("-1")
    assert changed(before, view.pixels(canvas(view))) < 0.005


def test_the_legend_hides_a_part_by_its_key(view: Visit) -> None:
    before = view.pixels(canvas(view))
    box = view.page.get_by_label("guide support", exact=False).first
    box.focus()
    view.page.keyboard.press("Space")
    assert not box.is_checked()
    assert changed(before, view.pixels(canvas(view))) > 0.01
    view.page.keyboard.press("Space")
    assert changed(before, view.pixels(canvas(view))) < 0.005


def test_the_buttons_look_from_other_sides(view: Visit) -> None:
    before = view.pixels(canvas(view))
    for name in ("Front", "Above", "Below"):
        view.page.get_by_role("button", name=name).focus()
        view.page.keyboard.press("Enter")
        after = view.pixels(canvas(view))
        assert changed(before, after) > 0.02, name
        before = after


def test_the_drawing_is_kept_for_printing(view: Visit) -> None:
    """Browsers print what the buffer of a canvas holds, long after it was shown."""
    view.drawn()
    opaque = canvas(view).evaluate(
        """(shown) => {
          const copy = document.createElement("canvas");
          copy.width = shown.width; copy.height = shown.height;
          const flat = copy.getContext("2d");
          flat.drawImage(shown, 0, 0);
          const bytes = flat.getImageData(0, 0, copy.width, copy.height).data;
          return bytes.filter((value, at) => at % 4 === 3 && value > 0).length / bytes.length;
        }"""
    )
    assert opaque > 0.01
