"""Pages cause no errors, fit a small screen, and work with keyboard and screen reader.

That no page complains or asks for anything is looked at after each of these tests.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser

from .conftest import opening
from .pages import EVIL
from .visit import DESKTOP, TELEPHONE, Visit

KINDS = [
    "render", "ledger", "scores", "study", "errors", "verify", "comparison", "calibration",
]  # fmt: skip
CONTROLS = {"button", "slider", "combobox", "checkbox", "link", "textbox", "spinbutton"}
FOCUSED = """() => {
  const at = document.activeElement;
  if (!at || at === document.body) return null;
  at.visited = true;
  const style = getComputedStyle(at);
  return { what: at.outerHTML.slice(0, 90), seen: style.outlineStyle !== "none" &&
    parseFloat(style.outlineWidth) > 0 && style.outlineColor !== "rgba(0, 0, 0, 0)" };
}"""
NOT_VISITED = """() => [...document.querySelectorAll(
  "button, input, select, summary, a[href], [tabindex='0']")].filter(
  (each) => each.checkVisibility() && !each.visited).map((each) => each.outerHTML.slice(0, 90))"""
MOST_CONTROLS = 300


@pytest.fixture(scope="module", params=KINDS)
def opened(
    request: pytest.FixtureRequest, browser: Browser, pages: dict[str, Path]
) -> Iterator[Visit]:
    """A kind of page in a window that tests share."""
    with opening(browser) as open_page:
        yield open_page(pages[request.param], DESKTOP)


def test_texts_stay_texts(opened: Visit) -> None:
    page = opened.page
    assert page.locator("h1").inner_text().startswith(EVIL)
    assert EVIL in page.title()
    assert page.evaluate("() => window.ran") is None
    assert page.locator("img[src=x]").count() == 0


def test_every_control_has_a_name(opened: Visit) -> None:
    """The names are those that the browser tells a screen reader."""
    page = opened.page
    tree = page.context.new_cdp_session(page).send("Accessibility.getFullAXTree")
    for node in tree["nodes"]:
        if not node["ignored"] and node["role"]["value"] in CONTROLS | {"image", "Canvas"}:
            assert node["name"]["value"].strip(), node


def test_the_focus_is_seen_on_every_control(opened: Visit) -> None:
    page = opened.page
    for _ in range(MOST_CONTROLS):
        page.keyboard.press("Tab")
        found = page.evaluate(FOCUSED)
        if found is None:  # the last one was left
            break
        assert found["seen"], found
    assert page.evaluate(NOT_VISITED) == []


def test_no_page_scrolls_sideways(opened: Visit) -> None:
    for width, height in (TELEPHONE, DESKTOP):
        opened.page.set_viewport_size({"width": width, "height": height})
        for unfolded in (False, True):
            for each in opened.page.locator("details").all():
                each.evaluate("(each, open) => { each.open = open; }", unfolded)
            opened.drawn()
            assert not opened.is_scrolled_sideways()


def test_paper_is_white_also_in_dark_mode(opened: Visit) -> None:
    page = opened.page
    page.emulate_media(media="print", color_scheme="dark")
    colour = page.evaluate("() => getComputedStyle(document.body).color")
    keys = page.evaluate(
        """() => [...document.querySelectorAll(".swatch, .scale")].filter(
             (each) => getComputedStyle(each).printColorAdjust !== "exact").length"""
    )
    page.emulate_media(media=None, color_scheme=None)
    assert colour == "rgb(28, 35, 43)"
    assert keys == 0
