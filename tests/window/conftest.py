"""The window test runs only where a Blender with a window was set up: `make studio-window-test`."""

from __future__ import annotations

import os

BLENDER = "OPTISENSE_WINDOW_BLENDER"

if not os.environ.get(BLENDER):
    collect_ignore_glob = ["test_*.py"]
