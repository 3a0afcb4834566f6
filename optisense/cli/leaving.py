"""The end of the process."""

from __future__ import annotations

import atexit
import contextlib
import os
import sys
import threading
from collections.abc import Callable
from typing import NoReturn

from optisense.cli import stopping


def run_and_leave(command: Callable[[], object]) -> NoReturn:
    """Run a command that ends by SystemExit, and end the process with its exit code.

    Where the renderer is loaded, taking it down piece by piece takes a third of a second and
    changes nothing: the process then ends as soon as its files and streams are closed.
    """
    try:
        command()
    except SystemExit as stop:
        if stop.code is not None and not isinstance(stop.code, int):
            raise
        code = stopping.exit_code(stop.code or 0)
        if "drjit" not in sys.modules or _others_work():
            sys.exit(code)
        atexit._run_exitfuncs()
        for stream in (sys.stdout, sys.stderr):
            with contextlib.suppress(OSError, ValueError):
                stream.flush()
        os._exit(code)
    sys.exit(0)


def _others_work() -> bool:
    """Whether threads are at work that Python waits for at its end."""
    others = (each for each in threading.enumerate() if each is not threading.main_thread())
    return any(not each.daemon for each in others)
