"""The sensor bench in Blender, as somebody sits before it: eyes (`see`), mouse and keys."""

from __future__ import annotations

import itertools
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

from .desktop import SIZE, Desktop, nothing
from .sidebar import Sidebar

PATIENCE = 300.0
"""Time (s) after which a test fails because an expected event has not occurred."""

FAR = "(state().busy, state().progress, state().per_cent)"
"""What the engine works on, and how far it is."""

CHOICE = 20
"""Pixels from one choice to the next of a control with pictures in place of words."""

ROOM_ABOVE = 20
"""Pixels above the files in the window that asks for one: its path and search are there."""

TRIES = 5
"""To close Blender: a key may come before the question that it answers."""


class Bench(Sidebar):
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

    def start(self, file: Path | None = None, design: str = "") -> None:
        """Start Blender, with a file of its own if one is given, or as `optisense studio DESIGN`
        does.
        """
        address = self.home / "agent"
        address.unlink(missing_ok=True)
        environment = {
            **os.environ,
            **own_place(self.home),
            "DISPLAY": self.desktop.name,
            "OPTISENSE_AGENT": str(address),
        }
        environment.pop("OPTISENSE_ENGINE", None)  # it knows that from when it was installed
        environment.update({"OPTISENSE_OPEN": design} if design else {})
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
        self.desktop.settle = self.settle

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

    def until(self, expression: str, patience: float = PATIENCE, *, refused: bool = False) -> Any:
        """Wait until an expression is true; nothing may be refused meanwhile, or has been before.

        Args:
            expression: a Python expression.
            patience: seconds to wait.
            refused: whether a message about a refusal may stand meanwhile.
        """
        end = time.monotonic() + patience
        while not (value := self.see(expression)):
            assert time.monotonic() < end, f"never: {expression}; said: {self.said()}\n{self.log()}"
            assert refused or not self.see("state().problem"), self.said()
            time.sleep(0.03)
        return value

    def settle(self) -> None:
        """Wait until Blender has handled what mouse and keys did, and has drawn what came of it.

        It answers before it handles what has come since, and draws after that: the first answer
        says that all has come, the second that it is handled, the third that an operator that a
        button called has run, too.
        """
        for _ in range(3):
            self.see("1")

    def said(self) -> str:
        """The message in the panel."""
        return str(self.see("'; '.join(t for t in (state().problem, state().hint, state().note)"
                            " if t)"))  # fmt: skip

    def rest(self) -> None:
        """Wait until a long job is over, and that it went well; as long as there is progress."""
        far, end = None, 0.0
        while (now := self.see(FAR))[0]:
            if now != far:
                far, end = now, time.monotonic() + PATIENCE
            assert time.monotonic() < end, f"no progress since {now}; said: {self.said()}"
            time.sleep(0.03)
        assert not self.see("state().problem"), self.said()

    def refused(self) -> str:
        """Wait until something is refused; what is said about it."""
        end = time.monotonic() + PATIENCE
        while not (told := self.see("state().problem")):
            assert time.monotonic() < end, f"nothing is refused; said: {self.said()}\n{self.log()}"
            time.sleep(0.03)
        return str(told)

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

    def tick(self, objective: str) -> None:
        """Tick an objective, or clear it, in the two columns of the panel Evaluate."""
        names = self.see(
            "[each['name'] for each in part('engine.catalogue').entries('objectives')]"
        )
        across = (0.25, 0.75)[names.index(objective) % 2]
        self.press(f'optisense.choose_objective(objective="{objective}")', across=across)

    def new_sensor(self, name: str, *, panels: bool = True) -> None:
        """Start from a built-in sensor.

        Args:
            name: the sensor's.
            panels: whether all panels are opened then.
        """
        self.until("bool(part('engine.catalogue').entries('sensors'))")
        names = self.see("[each['name'] for each in part('engine.catalogue').entries('sensors')]")
        x, y = self.find("optisense.open", across=0.25)
        self.choose((x, y - 22), names.index(name))
        self.until(f"scene().optisense.title == {name!r} and not state().busy")
        if panels:
            self.open_all()

    def photograph(self, name: str, part: str = "", start: int = 0, height: int = 0) -> None:
        """Keep a picture of this step for the documentation, where that is wanted.

        Args:
            name: of the picture's file.
            part: `WINDOW` for the 3D view with its sidebar, `UI` for the sidebar; else all.
            start, height: pixels from the top of that part to what is kept of it, and its height; 0
                for all.
        """
        folder = os.environ.get("OPTISENSE_WINDOW_PICTURES")
        if folder:
            self.drawn()
            box = None
            if part:
                left, top, width, whole = self.see(f"place('VIEW_3D', {part!r})")
                box = (left, top + start, left + width, top + start + (height or whole))
            self.desktop.picture(Path(folder) / f"{name}.jpg", box)

    def press_above_picture(self, what: str, number: int = 0) -> None:
        """Find a control above the picture in the workspace and click on it.

        Args:
            what: its name.
            number: place among the choices of a control that has several, the first is 0.
        """
        left, top, width, height = self.see("place('IMAGE_EDITOR', 'TOOL_HEADER')")
        y = top + height // 2
        where = f"IMAGE_EDITOR TOOL_HEADER {y} {left + 6} {left + width} 8"
        x, seen = self.see(f"along {where} {what}")
        assert x is not None, f"no control '{what}' above the picture; there are: {seen}"
        self.desktop.click(x + 4 + number * CHOICE, y)

    def view(self) -> NDArray[np.int64]:
        """(h, w, 3) what the 3D view shows, 0 to 255."""
        self.drawn()
        left, top, width, height = self.see("place('VIEW_3D', 'WINDOW')")
        shown = self.desktop.shown().crop((left, top, left + width, top + height))
        return np.asarray(shown, dtype=np.int64)

    def files_shown(self) -> None:
        """Wait for the window in which a file is asked for, and move it into the display."""
        self.until("any(a.type == 'FILE_BROWSER' for w in manager.windows for a in w.screen.areas)")
        self.until("region('FILE_BROWSER', 'EXECUTE').width > 1")
        if self.see("place('FILE_BROWSER', 'WINDOW')")[1] < ROOM_ABOVE:
            self.desktop.bring_down("Blender File View")
            self.until(f"place('FILE_BROWSER', 'WINDOW')[1] >= {ROOM_ABOVE}")

    def choose_file(self, name: str = "") -> None:
        """Click on a file where one is asked for, if a name is given, and then on the button."""
        self.files_shown()
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

    def drag(self, *places: tuple[float, float], steps: int = 8) -> None:
        """Press the mouse's button at the first place, move it in steps as a hand does to the
        others, and let it go.
        """
        self.desktop.move(*places[0])
        self.drawn()
        self.desktop.press(True)
        for start, end in itertools.pairwise(places):
            for step in range(1, steps + 1):
                x, y = (a + (b - a) * step / steps for a, b in zip(start, end, strict=True))
                self.desktop.move(x, y)
                self.see("1")
            self.drawn()
        self.desktop.press(False)
        self.drawn()

    def over_view(self) -> None:
        """Put the mouse over the 3D view, for keys that are meant for it."""
        left, top, width, height = self.see("place('VIEW_3D', 'WINDOW')")
        self.desktop.move(left + width * 0.3, top + height - 60)
        self.see("1")

    def quit(self) -> None:
        """Close Blender as a user does, saving the file when it asks."""
        self.over_view()
        self.desktop.settle = nothing
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
