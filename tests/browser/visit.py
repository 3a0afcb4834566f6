"""A page in a window of a browser, and what it says and asks for."""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PIL import Image
from playwright.sync_api import Browser, Locator

DESKTOP, TELEPHONE = (1280, 900), (390, 844)

PATIENCE = 600_000.0
"""Longest time (ms) of a step of a browser. Only one that hangs takes so long, while on a busy
machine a step can take more than the 30 s of Playwright's default."""


class Visit:
    """A page that was opened.

    Attributes:
        page: as playwright's.
        complaints: errors and warnings of its console, and what its scripts threw.
        asked_for: addresses that it wanted, other than its own.
    """

    def __init__(
        self,
        browser: Browser,
        page: Path | str,
        size: tuple[int, int],
        allowed: Sequence[str] = (),
        **context: object,
    ) -> None:
        """`allowed`: addresses that the page may ask for, beside its own."""
        self._allowed = allowed
        self.complaints: list[str] = []
        self.asked_for: list[str] = []
        self._context = browser.new_context(
            viewport={"width": size[0], "height": size[1]}, **context
        )
        self._context.set_default_timeout(PATIENCE)
        self.page = self._context.new_page()
        address = page if isinstance(page, str) else page.resolve().as_uri()
        self.page.on("console", self._hear)
        self.page.on("pageerror", lambda error: self.complaints.append(str(error)))
        self.page.on("request", lambda request: self._note(request.url, address))
        self.page.goto(address, wait_until="load")

    def _hear(self, message: object) -> None:
        if message.type in ("error", "warning") and "GPU stall" not in message.text:
            self.complaints.append(message.text)

    def _note(self, wanted: str, own: str) -> None:
        if wanted != own and wanted not in self._allowed and not wanted.startswith("data:"):
            self.asked_for.append(wanted)

    def close(self) -> None:
        self._context.close()

    def drawn(self) -> None:
        """Wait until what was asked for is drawn: two frames of the browser."""
        self.page.evaluate(
            "() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))"
        )

    def pixels(self, what: Locator) -> np.ndarray:
        """(h, w, 3) of an element as it is on the screen."""
        self.drawn()
        image = Image.open(io.BytesIO(what.screenshot())).convert("RGB")
        return np.asarray(image).astype(np.int16)

    def is_scrolled_sideways(self) -> bool:
        """Whether the page is wider than its window."""
        return self.page.evaluate(
            "() => document.documentElement.scrollWidth > document.documentElement.clientWidth"
        )
