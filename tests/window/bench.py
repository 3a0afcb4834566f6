"""The sensor bench in Blender, as somebody sits before it: eyes (`see`), mouse and keys."""

from __future__ import annotations

import json
import os
import socket
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .desktop import SIZE, Desktop

PATIENCE = 300.0
"""Seconds after which something that does not happen has failed the test."""

ROW = 14
"""Pixels between places where a button is looked for; buttons are at least 18 high."""

SCROLLED, CLICK = 9, 40
"""Clicks of the wheel to see other buttons, and how many pixels a click moves them."""

BESIDE = 5
"""Pixels from the sidebar's edge where there are no buttons."""

HEAD = 28
"""Pixels from the head of a closed panel to the next one."""

TRIES = 5
"""To close all panels: a key may come later than the click that it belongs to."""

SCROLLED_TO = "region('VIEW_3D', 'UI').view2d.region_to_view(0, 0)[1]"
"""How far the sidebar is scrolled."""


class Bench:
    """Blender with the extension, in a window.

    Args:
        blender: the program; the extension is installed in it already.
        desktop: where its window is.
        home: the user's home folder.
    """

    def __init__(self, blender: Path, desktop: Desktop, home: Path) -> None:
        self.desktop = desktop
        self.home = home
        self._blender = blender
        self.start()

    def start(self, file: Path | None = None) -> None:
        """Start Blender, with a file of its own if one is given."""
        address = self.home / "agent"
        address.unlink(missing_ok=True)
        environment = {
            **os.environ,
            **own_place(self.home),
            "DISPLAY": self.desktop.name,
            "OPTISENSE_AGENT": str(address),
        }
        environment.pop("OPTISENSE_ENGINE", None)  # it knows that from when it was installed
        self._last = 0
        self._log = (self.home / "blender.log").open("ab")
        self.process = subprocess.Popen(
            [self._blender, *([file] if file else []),
             "--window-geometry", "0", "0", str(SIZE[0]), str(SIZE[1]),
             "--python", Path(__file__).with_name("agent.py")],
            env=environment,
            stdout=self._log,
            stderr=subprocess.STDOUT,
        )  # fmt: skip
        self._socket = socket.socket(socket.AF_UNIX)
        end = time.monotonic() + PATIENCE
        while self._socket.connect_ex(str(address)) != 0:
            assert self.process.poll() is None, self.log()
            assert time.monotonic() < end, self.log()
            time.sleep(0.1)
        self._answers = self._socket.makefile(encoding="utf-8")

    def log(self) -> str:
        """What Blender wrote last."""
        return (self.home / "blender.log").read_text(errors="replace")[-3000:]

    def see(self, expression: str) -> Any:
        """What Blender holds, as a Python expression says it."""
        self._socket.sendall(expression.encode() + b"\n")
        line = self._answers.readline()
        assert line, f"Blender is gone\n{self.log()}"
        answer = json.loads(line)
        assert "error" not in answer, f"{expression}: {answer['error']}"
        return answer["value"]

    def until(self, expression: str, patience: float = PATIENCE) -> Any:
        """Wait until an expression is true."""
        end = time.monotonic() + patience
        while not (value := self.see(expression)):
            assert time.monotonic() < end, f"never: {expression}; said: {self.said()}\n{self.log()}"
            assert not self.see("state().problem"), self.said()
            time.sleep(0.03)
        return value

    def said(self) -> str:
        """The message in the panel."""
        return str(self.see("'; '.join(t for t in (state().problem, state().hint, state().note)"
                            " if t)"))  # fmt: skip

    def rest(self) -> None:
        """Wait until a long job is over, and that it went well."""
        self.until("not state().busy")
        assert not self.see("state().problem"), self.said()

    def drawn(self) -> None:
        """Wait until all that changed is drawn."""
        frame = self.see("(area('VIEW_3D').tag_redraw(), frames[0])")[1]
        self.until(f"frames[0] > {frame}")
        self.see("1")

    def greet(self) -> None:
        """Wait for the window to be drawn, and send the greeting away by Esc."""
        self.until("window().screen.areas[0].width > 1")
        left, top, width, height = self.see("place('VIEW_3D', 'WINDOW')")
        self.desktop.move(left + width / 2, top + height - 60)
        self.desktop.keys("Escape")
        self.see("1")

    # --- the mouse in the sidebar ---------------------------------------------------------------

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
        self._on_head(x, y + HEAD * panel)

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
        return bool(self.see(SCROLLED_TO) != before)

    def press(self, what: str, *, across: float = 0.5) -> None:
        """Find a button and click on it."""
        x, y = self.find(what, across=across)
        self.desktop.click(x, y)

    def choose(self, menu: tuple[int, int], number: int) -> None:
        """Open a menu by a click and choose an entry by keys, the first is 0."""
        self.desktop.click(*menu)
        self.see("1")
        self.desktop.keys("Home", *["Down"] * number, "Return")

    def enter(self, what: str, text: str) -> None:
        """Find a field, and type a text in place of the one that is there."""
        x, y = self.find(what, across=0.7)
        self.enter_at((x, y + 3), text)

    def enter_at(self, spot: tuple[int, int], text: str, *, times: int = 1) -> None:
        """The same where a field is known to be; in a list it takes two clicks."""
        self.desktop.click(*spot, times=times)
        self.see("1")
        self.desktop.keys("ctrl+a")
        self.desktop.write(text)
        self.desktop.keys("Return")

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

    def new_sensor(self, name: str) -> None:
        """Start from a built-in sensor."""
        self.until("bool(part('engine.catalogue').entries('sensors'))")
        names = self.see("[each['name'] for each in part('engine.catalogue').entries('sensors')]")
        x, y = self.find("optisense.open", across=0.25)
        self.choose((x, y - 22), names.index(name))
        self.until("scene().optisense.is_open and not state().busy")

    def photograph(self, name: str) -> None:
        """Keep a picture of this step for the documentation, where that is wanted."""
        folder = os.environ.get("OPTISENSE_WINDOW_PICTURES")
        if folder:
            self.drawn()
            self.desktop.picture(Path(folder) / f"{name}.jpg")

    def view(self) -> NDArray[np.int64]:
        """(h, w, 3) what the 3D view shows, 0 to 255."""
        self.drawn()
        left, top, width, height = self.see("place('VIEW_3D', 'WINDOW')")
        shown = self.desktop.shown().crop((left, top, left + width, top + height))
        return np.asarray(shown, dtype=np.int64)

    def choose_file(self, name: str = "") -> None:
        """Click on a file where one is asked for, if a name is given, and then on the button."""
        self.until("any(a.type == 'FILE_BROWSER' for w in manager.windows for a in w.screen.areas)")
        self.until("region('FILE_BROWSER', 'EXECUTE').width > 1")
        if name:
            left, top, _, height = self.see("place('FILE_BROWSER', 'WINDOW')")
            for y in range(top + 30, top + height, 10):
                self.desktop.click(left + 60, y)
                if self.see("chosen_file()") == name:
                    break
            else:
                raise AssertionError(f"no file '{name}' is offered")
        left, top, width, height = self.see("place('FILE_BROWSER', 'EXECUTE')")
        self.desktop.click(left + width - 70, top + height / 2)
        self.until("len(manager.windows) == 1")

    def select_part(self, name: str, at: tuple[float, float, float], *, too: bool = False) -> None:
        """Click on a part in the view.

        Args:
            name: the part's.
            at: mm, a point of it that is not hidden.
            too: besides what is selected, with the key Shift.
        """
        if too:
            self.desktop.hold("shift", True)
        self.desktop.click(*self.see(f"on_screen({at})"))
        self.see("1")
        if too:
            self.desktop.hold("shift", False)
        self.see("1")
        self.drawn()
        chosen = self.see("[each.name for each in scene().objects if each.select_get()]")
        assert name in chosen, f"a click on '{name}' selected: {', '.join(chosen) or 'nothing'}"

    def over_view(self) -> None:
        """Put the mouse over the 3D view, for keys that are meant for it."""
        left, top, width, height = self.see("place('VIEW_3D', 'WINDOW')")
        self.desktop.move(left + width * 0.3, top + height - 60)
        self.see("1")

    def quit(self) -> None:
        """Close Blender as a user does, saving the file when it asks."""
        self.over_view()
        self.desktop.keys("ctrl+q")
        for _ in range(TRIES):
            try:
                self.process.wait(2)
                break
            except subprocess.TimeoutExpired:
                self.desktop.keys("Return")
        self.process.wait(PATIENCE)
        self._log.close()

    def close(self) -> None:
        """End Blender."""
        self.process.terminate()
        try:
            self.process.wait(15)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        self._log.close()


def own_place(home: Path) -> dict[str, str]:
    """The environment in which Blender keeps everything in a folder of its own."""
    return {"HOME": str(home), "BLENDER_USER_RESOURCES": str(home / "blender")}


def install(blender: Path, home: Path) -> None:
    """Put the extension into that Blender, as a user does."""
    command = [sys.executable, "-m", "optisense.cli", "studio", "--no-start"]
    subprocess.run(
        [*command, "--blender", blender],
        env={**os.environ, **own_place(home)},
        check=True,
        timeout=PATIENCE,
    )
