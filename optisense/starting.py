"""The end of a process that a signal reaches while Python still imports what it needs.

An exception at such a moment would come out of any line of any package: as a traceback, as an error
of another kind, or as an abort of compiled code. So the process ends there and then, which loses
nothing: no work has begun.
"""

from __future__ import annotations

import os
import signal
from types import FrameType
from typing import NoReturn

_begun = False


def begin() -> None:
    """From here on, work is done that a signal may have to wait for: called as a command begins."""
    global _begun
    _begun = True


def has_begun() -> bool:
    """Whether `begin` was called."""
    return _begun


def leave_on_signals() -> None:
    """From here on, Ctrl-C and SIGTERM end the process with 130 or 143 and one word.

    A signal that is ignored, as of programs that a shell runs in the background, stays so.
    """
    for number in (signal.SIGINT, signal.SIGTERM):
        if signal.getsignal(number) in (signal.default_int_handler, signal.SIG_DFL):
            signal.signal(number, leave)


def leave(number: int, frame: FrameType | None = None) -> NoReturn:
    """End the process with 128 and the number of the signal, as shells count."""
    os.write(2, b"interrupted\n")
    os._exit(128 + number)
