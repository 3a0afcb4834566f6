"""End of the process."""

from __future__ import annotations

import atexit
import contextlib
import os
import sys
import threading
from collections.abc import Callable
from typing import NoReturn

from optisense.cli import stopping
from optisense.cli.console import EXIT_INTERRUPTED, messages


def run_and_leave(command: Callable[[], object]) -> NoReturn:
    """Run a command that ends by SystemExit, and end the process with its exit code.

    The process ends as soon as its threads have ended and its files and streams are closed.
    Python's normal shutdown, which destroys modules one by one, takes a third of a second after the
    renderer was loaded, and an interrupt that was handled long ago can change the exit code there.
    """
    code = 0
    try:
        command()
    except SystemExit as stop:
        if stop.code is not None and not isinstance(stop.code, int):
            raise
        code = stopping.exit_code(stop.code or 0)
    except KeyboardInterrupt:  # outside of a command, such as while a usage error is printed
        messages.print("interrupted")
        code = stopping.exit_code(EXIT_INTERRUPTED)
    stopping.finish(code)
    for each in threading.enumerate():  # as Python waits for them at its end
        if not each.daemon and each is not threading.main_thread():
            each.join()
    atexit._run_exitfuncs()
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(OSError, ValueError):
            stream.flush()
    os._exit(code)
