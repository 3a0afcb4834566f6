"""The window test runs only where a Blender with a window was set up: `make studio-window-test`."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

from .bench import Bench, install
from .desktop import Desktop

BLENDER = "OPTISENSE_WINDOW_BLENDER"
PICTURES = "OPTISENSE_WINDOW_PICTURES"

SHOWN_HOME = Path(tempfile.gettempdir()) / "sensors"
"""Home folder while pictures for the documentation are made, which show its name."""

if not os.environ.get(BLENDER):
    collect_ignore_glob = ["test_*.py"]


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Bench]:
    """Blender with the extension, installed as a user does."""
    blender = Path(os.environ[BLENDER]).resolve()
    if os.environ.get(PICTURES):
        home = SHOWN_HOME
        shutil.rmtree(home, ignore_errors=True)  # a run that was killed leaves it
        home.mkdir()
    else:
        home = tmp_path_factory.mktemp("home")
    install(blender, home)
    desktop = Desktop()
    sitting = Bench(blender, desktop, home)
    try:
        yield sitting
    finally:
        sitting.close()
        desktop.close()
        if home == SHOWN_HOME:
            shutil.rmtree(home)
