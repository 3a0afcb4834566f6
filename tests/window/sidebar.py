"""The mouse in the sidebar: panels are opened and closed, and buttons found by their names."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any

from .desktop import Desktop

ROW = 14
"""Pixels between places where a button is looked for; buttons are at least 18 high."""

SCROLLED, CLICK = 9, 40
"""Clicks of the wheel to see other buttons, and how many pixels a click moves them."""

BESIDE = 5
"""Pixels from the sidebar's edge where there are no buttons."""

HEAD = 28
"""Pixels from the head of a closed panel to the next one."""

PANELS = 9
"""Number of panels of the tab while a sensor is open."""

SCROLLED_TO = "region('VIEW_3D', 'UI').view2d.region_to_view(0, 0)[1]"
"""How far the sidebar is scrolled."""

TRIES = 5
"""To close all panels: a key may come later than the click that it belongs to."""


class Sidebar(ABC):
    """The part of a bench that is about the sidebar of its 3D view."""

    desktop: Desktop
    _last = 0
    """How far down the button is that was found last."""

    @abstractmethod
    def see(self, expression: str) -> Any:
        """What Blender holds."""

    @abstractmethod
    def until(self, expression: str) -> Any:
        """Wait until an expression is true."""

    @abstractmethod
    def drawn(self) -> None:
        """Wait until all that changed is drawn."""

    def sidebar(self) -> tuple[int, int, int, int]:
        """Left, top, width and height of its part with buttons, in pixels."""
        left, top, width, height = self.see("place('VIEW_3D', 'UI')")
        return left, top, width - 22, height

    def open_tab(self) -> None:
        """Open the sidebar by its key, and click on its tabs until ours is open."""
        left, top, width, height = self.see("place('VIEW_3D', 'WINDOW')")
        self.desktop.move(left + width / 2, top + height / 2)
        self.desktop.keys("n")
        self.until("region('VIEW_3D', 'UI').width > 1")
        left, top, width, height = self.see("place('VIEW_3D', 'UI')")
        for y in range(top + 40, top + height, 25):
            self.desktop.click(left + width - 9, y)
            self.see("1")
            if self.see("region('VIEW_3D', 'UI').active_panel_category") == "OptiSense":
                return
        raise AssertionError("there is no tab OptiSense")

    def find(self, what: str, *, across: float = 0.5) -> tuple[int, int]:
        """Look for a button: where it was seen last, from where the mouse is down, then everywhere.

        Args:
            what: the whole name of its operator, with arguments where several buttons have it, or
                of its property; see `is_named` of the agent.
            across: where to look, 0 is the sidebar's left edge and 1 its right one.
        """
        left, top, width, height = self.sidebar()
        x, end = round(left + width * across), top + height - 6
        seen: list[str] = []
        y = self._seen(what, x, max(self._last - ROW, top + 6), end, seen)
        if y is None:
            self.to_top()
        while y is None:
            y = self._seen(what, x, top + 6, end, seen)
            if y is None and not self.scroll(SCROLLED):
                break
        assert y is not None, (
            f"no button '{what}' in the sidebar; {across:g} across there are: {', '.join(seen)}"
        )
        self._last = y
        return x, y

    def _seen(self, what: str, x: int, top: int, end: int, seen: list[str]) -> int | None:
        """How far down a button is in a part of the sidebar that is in view.

        Args:
            what: its name.
            x, top, end: where to look, pixels.
            seen: names of buttons, to which those are added that are there.
        """
        y, names = self.see(f"scan {x} {top} {end} {ROW} {what}")
        seen += [each for each in names if each not in seen]
        if y is not None:
            self.drawn()  # the wheel is quicker than the sidebar: it may have moved meanwhile
            y, _ = self.see(f"scan {x} {y - 3} {y + 2 * ROW} 3 {what}")
        return None if y is None else int(y)

    def to_top(self) -> None:
        """Show the sidebar's first panel, by the key Home over it."""
        left, top, width, _ = self.sidebar()
        self.desktop.move(left + width / 2, top + 6)
        self.see("1")
        self.desktop.keys("Home")
        self._last = 0
        self.drawn()

    def only(self, panel: int) -> None:
        """Open one panel and close all others, by clicks on their heads; the first is 0."""
        x, y = self._close_all()
        self._on_head(x, y + HEAD * panel)

    def open_all(self) -> None:
        """Open all panels, the last one first: those above it stay where they are."""
        x, y = self._close_all()
        for panel in reversed(range(PANELS)):
            self._on_head(x, y + HEAD * panel)

    def _close_all(self) -> tuple[float, float]:
        """Close all panels; where the head of the first is."""
        left, top, width, _ = self.sidebar()
        x, y = left + width / 2, top + HEAD / 2
        for _ in range(TRIES):
            self.to_top()
            self._on_head(x, y, "ctrl")  # closes all others, where the key came before the click
            if self._shows_buttons():
                self._on_head(x, y)
            if not self._shows_buttons():
                break
        else:
            raise AssertionError("the panels can't be closed")
        return x, y

    def _on_head(self, x: float, y: float, held: str = "") -> None:
        """Click on the head of a panel, while a key is down if one is named."""
        self.desktop.move(x, y)
        if held:
            self.desktop.hold(held, True)
            self.see("1")
        self.desktop.click(x, y)
        self.see("1")
        if held:
            self.desktop.hold(held, False)
        self.drawn()

    def _shows_buttons(self) -> bool:
        """Whether any of the extension's buttons is in view, where an open panel has one."""
        left, top, width, _ = self.sidebar()
        x, end = round(left + width * 0.25), top + 11 * HEAD
        return self.see(f"scan {x} {top + HEAD} {end} {ROW} optisense.*")[0] is not None

    def scroll(self, clicks: int) -> bool:
        """Turn the mouse's wheel over the sidebar, down is positive; whether that moved it."""
        left, top, _, height = self.sidebar()
        before = self.see(SCROLLED_TO)
        self.desktop.click(  # beside the buttons: over a list, the wheel would turn that
            left + BESIDE, top + height / 2, button=5 if clicks > 0 else 4, times=abs(clicks)
        )
        self.see("1")
        self.drawn()
        self._last = 0  # a button may be further up now than where it was found
        return bool(self.see(SCROLLED_TO) != before)

    def press(self, what: str, *, across: float = 0.5) -> None:
        """Find a button and click on it."""
        x, y = self.find(what, across=across)
        self.desktop.click(x, y)

    def bring(self, what: str, down: float, *, across: float = 0.5) -> tuple[int, int]:
        """Scroll until a button is so far down the sidebar, 0 is its top and 1 its end."""
        _, top, _, height = self.sidebar()
        for _ in range(3):
            y = self.find(what, across=across)[1]
            clicks = round((y - top - down * height) / CLICK)
            if clicks == 0:
                break
            self.scroll(clicks)
        return self.find(what, across=across)
