"""End of a process that a signal reaches while Python still imports modules.

An exception at such a moment could come out of any line of any package: as a traceback, as an error
of another kind, or as an abort of compiled code. So the process ends at once, which loses nothing:
no work has begun.
"""

from __future__ import annotations

import os
import signal
from types import FrameType
from typing import NoReturn

_begun = False


def begin() -> None:
    """Record that work has begun, for which a signal may wait; called as a command begins."""
    global _begun
    _begun = True


def has_begun() -> bool:
    """Return whether `begin` was called."""
    return _begun


def exit_on_signals() -> None:
    """Let Ctrl-C and SIGTERM end the process with 130 or 143 and one word from here on.

    A signal that is ignored, as in programs that a shell runs in the background, stays ignored.
    """
    for number in (signal.SIGINT, signal.SIGTERM):
        if signal.getsignal(number) in (signal.default_int_handler, signal.SIG_DFL):
            signal.signal(number, leave)


def leave(number: int, frame: FrameType | None = None) -> NoReturn:
    """End the process with 128 and the number of the signal, as shells count."""
    os.write(2, b"interrupted\n")
    os._exit(128 + number)
