"""The end of the process."""

from __future__ import annotations

import atexit
import contextlib
import os
import sys
import threading
from collections.abc import Callable
from typing import NoReturn


def run_and_leave(command: Callable[[], object]) -> NoReturn:
    """Run a command that ends by SystemExit, and end the process with its exit code.

    Where the renderer is loaded, taking it down piece by piece takes a third of a second and
    changes nothing: the process then ends as soon as its files and streams are closed.
    """
    try:
        command()
    except SystemExit as stop:
        if "drjit" not in sys.modules or threading.active_count() > 1:
            raise
        if stop.code is not None and not isinstance(stop.code, int):
            raise
        atexit._run_exitfuncs()
        for stream in (sys.stdout, sys.stderr):
            with contextlib.suppress(OSError, ValueError):
                stream.flush()
        os._exit(stop.code or 0)
    sys.exit(0)
