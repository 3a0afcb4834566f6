"""Pages cause no errors, fit a small screen, and work with keyboard and screen reader.

That no page complains or asks for anything is looked at after each of these tests.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from .conftest import Open
from .pages import EVIL
from .visit import DESKTOP, TELEPHONE

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


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("size", [DESKTOP, TELEPHONE], ids=["desktop", "telephone"])
def test_no_page_scrolls_sideways(
    visit: Open, pages: dict[str, Path], kind: str, size: tuple[int, int]
) -> None:
    window = visit(pages[kind], size)
    window.drawn()
    assert not window.is_scrolled_sideways()
    for folded in window.page.locator("details").all():
        folded.evaluate("(each) => { each.open = true; }")
    assert not window.is_scrolled_sideways()


@pytest.mark.parametrize("kind", KINDS)
def test_texts_stay_texts(visit: Open, pages: dict[str, Path], kind: str) -> None:
    page = visit(pages[kind]).page
    assert page.locator("h1").inner_text().startswith(EVIL)
    assert EVIL in page.title()
    assert page.evaluate("() => window.ran") is None
    assert page.locator("img[src=x]").count() == 0


@pytest.mark.parametrize("kind", KINDS)
def test_every_control_has_a_name(visit: Open, pages: dict[str, Path], kind: str) -> None:
    """The names are those that the browser tells a screen reader."""
    page = visit(pages[kind]).page
    tree = page.context.new_cdp_session(page).send("Accessibility.getFullAXTree")
    for node in tree["nodes"]:
        if not node["ignored"] and node["role"]["value"] in CONTROLS | {"image", "Canvas"}:
            assert node["name"]["value"].strip(), node


@pytest.mark.parametrize("kind", KINDS)
def test_the_focus_is_seen_on_every_control(visit: Open, pages: dict[str, Path], kind: str) -> None:
    page = visit(pages[kind]).page
    for _ in range(MOST_CONTROLS):
        page.keyboard.press("Tab")
        found = page.evaluate(FOCUSED)
        if found is None:  # the last one was left
            break
        assert found["seen"], found
    assert page.evaluate(NOT_VISITED) == []
