"""Ctrl-C during a render: stop at the next safe point, so that finished work can be written."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

from optisense.cli import stopping


class Interrupt:
    """Record of whether Ctrl-C was pressed."""

    def __init__(self) -> None:
        self.requested = False

    def raise_if_requested(self) -> None:
        """Raise KeyboardInterrupt here, at a safe point, if Ctrl-C was pressed."""
        if self.requested:
            raise KeyboardInterrupt

    def _pressed(self, number: int, frame: FrameType | None) -> None:
        if self.requested:
            raise KeyboardInterrupt
        self.requested = True
        stopping.print_wait()


@contextmanager
def deferred_interrupt() -> Iterator[Interrupt]:
    """Hold the first Ctrl-C back until a safe point; the second one acts at once.

    Nothing changes outside the main thread, where signals can't be handled, and where Ctrl-C is
    ignored, as shells arrange it for programs in the background.
    """
    interrupt = Interrupt()
    in_main_thread = threading.current_thread() is threading.main_thread()
    if not in_main_thread or signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        yield interrupt
        return
    before = signal.signal(signal.SIGINT, interrupt._pressed)
    try:
        yield interrupt
    finally:
        signal.signal(signal.SIGINT, before)
