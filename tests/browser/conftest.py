"""Report pages in a real browser: headless Chromium, where one is installed.

`make setup-browser` installs it on Debian and Ubuntu; OPTISENSE_BROWSER names another.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from shutil import which

import pytest
from playwright.sync_api import Browser, sync_playwright

from .pages import write_pages
from .visit import DESKTOP, PATIENCE, Visit

PROGRAMS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
FLAGS = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-gpu-compositing"]

Open = Callable[..., Visit]


@pytest.fixture(scope="package")
def browser() -> Iterator[Browser]:
    named = os.environ.get("OPTISENSE_BROWSER")
    program = named or next(filter(None, map(which, PROGRAMS)), None)
    if program is None:
        pytest.skip("no Chromium is installed: make setup-browser")
    with sync_playwright() as playwright:
        running = playwright.chromium.launch(executable_path=program, args=FLAGS, timeout=PATIENCE)
        yield running
        running.close()


@pytest.fixture(scope="package")
def pages(browser: Browser, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """One page of each kind; nothing is rendered where there is no browser."""
    return write_pages(tmp_path_factory.mktemp("pages"))


@pytest.fixture
def visit(browser: Browser) -> Iterator[Open]:
    """Opener of pages in new windows; none of them may report an error."""
    with opening(browser) as open_page:
        yield open_page


@contextmanager
def opening(browser: Browser) -> Iterator[Open]:
    """The same, for as many tests as one window serves."""
    visits: list[Visit] = []

    def open_page(page: Path | str, size: tuple[int, int] = DESKTOP, **context: object) -> Visit:
        visits.append(Visit(browser, page, size, **context))
        return visits[-1]

    yield open_page
    for each in visits:
        each.close()
    for each in visits:
        assert each.complaints == []
        assert each.asked_for == []
