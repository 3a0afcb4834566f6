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

from .desktop import SIZE, Desktop

PATIENCE = 120.0
"""Seconds after which something that does not happen has failed the test."""

ROW = 14
"""Pixels between places where a button is looked for; buttons are at least 18 high."""

SCROLLED, FAR_DOWN = 9, 90
"""Clicks of the wheel to see other buttons; more than these, and the sidebar is at its end."""


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
        address = home / "agent"
        environment = {
            **os.environ,
            **own_place(home),
            "DISPLAY": desktop.name,
            "OPTISENSE_AGENT": str(address),
        }
        environment.pop("OPTISENSE_ENGINE", None)  # it knows that from when it was installed
        self._last = self._down = 0
        self._log = (home / "blender.log").open("ab")
        self.process = subprocess.Popen(
            [blender, "--window-geometry", "0", "0", str(SIZE[0]), str(SIZE[1]),
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
        """Look for a button, from where the mouse is down and then from the top.

        Args:
            what: in its operator's or property's name.
            across: where to look, 0 is the sidebar's left edge and 1 its right one.
        """
        left, top, width, height = self.sidebar()
        x = round(left + width * across)
        rows = list(range(top + 6, top + height - 6, ROW))
        first = next((n for n, y in enumerate(rows) if y > self._last - ROW), 0)
        for turn in range(12):
            for y in rows[first:] + rows[:first] if turn == 0 else rows:
                # Seen again after what moved has been drawn: the wheel is quicker than the sidebar.
                if self._is_under(what, x, y) and self._stays(what, x, y):
                    self._last = y
                    return x, y
            self.scroll(+SCROLLED if self._down < FAR_DOWN else -FAR_DOWN)
        raise AssertionError(f"no button '{what}' in the sidebar")

    def _stays(self, what: str, x: int, y: int) -> bool:
        self.drawn()
        return self._is_under(what, x, y - 1) and self._is_under(what, x, y)

    def _is_under(self, what: str, x: int, y: int) -> bool:
        self.desktop.move(x, y)
        return what in self.see(f"at {x} {y} under()")

    def scroll(self, clicks: int) -> None:
        """Turn the mouse's wheel over the sidebar; down is positive."""
        left, top, width, height = self.sidebar()
        self._down = max(0, self._down + clicks)
        self.desktop.click(
            left + width / 2, top + height / 2, button=5 if clicks > 0 else 4, times=abs(clicks)
        )

    def press(self, what: str, *, across: float = 0.5) -> None:
        """Find a button and click on it."""
        x, y = self.find(what, across=across)
        self.desktop.click(x, y)

    def choose(self, menu: tuple[int, int], number: int) -> None:
        """Open a menu by a click and choose an entry by keys, the first is 0."""
        self.desktop.click(*menu)
        self.see("1")
        self.desktop.keys("Home", *["Down"] * number, "Return")

    def enter(self, what: str, text: str, *, times: int = 1) -> None:
        """Click into a field, type a text in place of the one that is there, and press Enter."""
        x, y = self.find(what, across=0.7)
        self.desktop.click(x, y + 2, times=times)
        self.see("1")
        self.desktop.keys("ctrl+a")
        self.desktop.write(text)
        self.desktop.keys("Return")

    def open_panel_below(self, above: str, inside: str) -> None:
        """Open the panel whose title comes below a button, where it is closed."""
        x, y = self.find(above, across=0.25)
        self.desktop.click(x, y + 40)
        self.find(inside, across=0.7)

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
