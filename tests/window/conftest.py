"""The window test runs only where a Blender with a window was set up: `make studio-window-test`."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from .bench import Bench, install
from .desktop import Desktop

BLENDER = "OPTISENSE_WINDOW_BLENDER"

if not os.environ.get(BLENDER):
    collect_ignore_glob = ["test_*.py"]


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Bench]:
    """Blender with the extension, installed as a user does."""
    blender, home = Path(os.environ[BLENDER]).resolve(), tmp_path_factory.mktemp("home")
    install(blender, home)
    desktop = Desktop()
    sitting = Bench(blender, desktop, home)
    try:
        yield sitting
    finally:
        sitting.close()
        desktop.close()
