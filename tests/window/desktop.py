"""A virtual display with a mouse and a keyboard."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Callable
from pathlib import Path
from shutil import which

from PIL import Image, ImageGrab

SIZE = (1280, 860)
PAGE = (1000, 1000)
"""Pixels of a picture on a page, at most."""


def nothing() -> None:
    """Do not wait."""


class Desktop:
    """A display of its own; what it shows is drawn by the processor.

    Attributes:
        actions: clicks, keys pressed and texts typed so far; a drag is one, a held key another.
        settle: waits until the program in front has handled what mouse and keys did so far.
    """

    settle: Callable[[], None]

    def __init__(self) -> None:
        self.actions = 0
        self.settle = nothing
        for program in ("Xvfb", "xdotool"):
            assert which(program), f"{program} is missing: sh scripts/setup_blender_window.sh"
        read, write = os.pipe()
        self._server = subprocess.Popen(
            ["Xvfb", "-displayfd", str(write), "-screen", "0", f"{SIZE[0]}x{SIZE[1]}x24",
             "-noreset", "-nolisten", "tcp", "+extension", "GLX"],
            pass_fds=[write],
            stderr=subprocess.DEVNULL,
        )  # fmt: skip
        os.close(write)
        with os.fdopen(read) as told:
            self.name = f":{told.readline().strip()}"

    def _do(self, *words: object) -> None:
        subprocess.run(
            ["xdotool", *map(str, words)],
            env={**os.environ, "DISPLAY": self.name},
            check=True,
            capture_output=True,
        )

    def move(self, x: float, y: float) -> None:
        """Move the mouse to a pixel, counted from the top left.

        The question for its place makes xdotool wait for the display. Its option --sync would wait
        15 s where the mouse is there already.
        """
        self._do("mousemove", round(x), round(y), "getmouselocation")

    def click(self, x: float, y: float, *, button: int = 1, times: int = 1) -> None:
        """Click somewhere, as a hand does: first there, then down, then up."""
        self.actions += times
        self.move(x, y)
        self.settle()
        self._do("click", "--repeat", times, "--delay", 60, button)
        self.settle()

    def press(self, down: bool) -> None:
        """Press the mouse's left button without letting it go, or let it go."""
        self.actions += down
        self._do("mousedown" if down else "mouseup", 1)

    def hold(self, key: str, down: bool) -> None:
        """Press a key without letting it go, or let it go."""
        self.actions += down
        self._do("keydown" if down else "keyup", key)

    def keys(self, *names: str) -> None:
        """Press keys, one after the other."""
        self.actions += len(names)
        for name in names:
            self._do("key", "--delay", 30, name)
            self.settle()

    def write(self, text: str) -> None:
        """Type a text."""
        self.actions += 1
        self._do("type", "--delay", 15, text)
        self.settle()

    def bring_down(self, title: str) -> None:
        """Move a window whose head is above the display down into it: there is nothing else that
        places windows.
        """
        search = ("search", "--onlyvisible", "--name", title)
        self._do(*search, "windowmove", "--sync", "x", 0)
        self.settle()

    def shown(self) -> Image.Image:
        """What the display shows."""
        return ImageGrab.grab(xdisplay=self.name).convert("RGB")

    def picture(self, path: Path, box: tuple[int, int, int, int] | None = None) -> None:
        """Keep what the display shows.

        Args:
            path: file of the picture.
            box: left, top, right and bottom of the part of it that is kept, pixels.
        """
        path.parent.mkdir(parents=True, exist_ok=True)
        picture = self.shown().crop(box)
        picture.thumbnail(PAGE)
        picture.save(path, quality=82, optimize=True)

    def close(self) -> None:
        """Take the display away."""
        self._server.terminate()
        self._server.wait(10)
