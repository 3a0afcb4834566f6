"""Ctrl-C and SIGTERM: an answer at once, an end at the next safe point, or at once after a second
signal.

Python runs its signal handlers in the main thread and between two of its own instructions, so they
wait while the renderer compiles or computes. A thread is told of the signal at once: it prints what
the command waits for, and ends the process shortly after a second signal.

Before a command begins, and after its end, a signal ends the process at once. While a command
imports a package, the signal waits: an exception amid an import becomes an error of another kind,
and an abort in compiled packages.
"""

from __future__ import annotations

import _thread
import os
import select
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import NoReturn

from optisense import starting
from optisense.cli.console import EXIT_INTERRUPTED, messages

EXIT_TERMINATED = 143
"""Exit code after SIGTERM: 128 and the number of the signal, as shells count."""

SILENCE = 1.0
"""Time after Ctrl-C to end without printing what the command waits for, s; most end sooner."""

GRACE = 1.5
"""Time after a second signal in which the command may still end by itself, s: enough to remove
temporary files.
"""


AGAIN = 0.02
"""Interval until a signal that came during an import is delivered again, s; short enough not to be
noticed, and most imports are finished by then.
"""

_IMPORTS = ("<frozen importlib._bootstrap>", "<frozen importlib._bootstrap_external>")
"""Files of Python's import functions."""


class _State:
    """Signals that this process has received, and what a first one waits for."""

    def __init__(self) -> None:
        self.signals = 0
        self.repeated = 0
        self.terminated = False
        self.said = False
        self.waits: Callable[[], str] | None = None


_state = _State()


@contextmanager
def waiting(waits: Callable[[], str] | None) -> Iterator[None]:
    """Context in which a first Ctrl-C waits for something, which ``waits`` tells in words.

    An example is "finishing trial 7, about 12 s"; None if Ctrl-C acts at once.
    """
    before, _state.waits = _state.waits, waits
    try:
        yield
    finally:
        _state.waits = before


def print_wait() -> None:
    """Print once what a first Ctrl-C waits for."""
    if _state.said:
        return
    _state.said = True
    what = "stopping after the current step" if _state.waits is None else _state.waits()
    if _state.terminated:
        said = f"SIGTERM: {what}; another one stops at once"
    else:
        said = f"Ctrl-C: {what}; press again to stop at once"
    messages.print(said, style="yellow")


def exit_code(code: int) -> int:
    """Return the exit code for a process that would exit with ``code``: 143 after SIGTERM."""
    return EXIT_TERMINATED if _state.terminated and code == EXIT_INTERRUPTED else code


def requested() -> bool:
    """Return whether Ctrl-C was pressed, or SIGTERM came."""
    return _state.signals > 0


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
        print_wait()


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


def install_handlers() -> None:
    """Handle signals in this process from here on; called once, at the start of the command line.

    SIGTERM then stops a command as Ctrl-C does. A SIGINT that is ignored, as in programs that a
    shell runs in the background, stays ignored: it is blocked, and its handler serves SIGTERM only.
    """
    reader, writer = os.pipe()
    os.set_blocking(writer, False)
    ignored = signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    if ignored and sys.platform != "win32":
        signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
    if not ignored or sys.platform != "win32":
        signal.signal(signal.SIGINT, _interrupt)
    signal.signal(signal.SIGTERM, _terminate)
    signal.set_wakeup_fd(writer, warn_on_full_buffer=False)
    threading.Thread(target=_answer, args=(reader,), name="signals", daemon=True).start()


def finish(code: int) -> None:
    """Let a signal end the process at once from here on, with the code of the finished command."""
    for number in (signal.SIGINT, signal.SIGTERM):
        if signal.getsignal(number) in (_interrupt, _terminate):
            signal.signal(number, lambda *_: os._exit(code))


def _interrupt(number: int, frame: FrameType | None) -> None:
    """Handle Ctrl-C: raise KeyboardInterrupt once a command has begun, but not amid an import."""
    if not starting.has_begun():
        starting.leave(signal.SIGTERM if _state.terminated else signal.SIGINT)
    if _imports(frame):
        timer = threading.Timer(AGAIN, _repeat)
        timer.daemon = True
        timer.start()
        return
    raise KeyboardInterrupt


def _imports(frame: FrameType | None) -> bool:
    """Return whether a frame, or one of its callers, imports a module."""
    while frame is not None:
        if frame.f_code.co_filename in _IMPORTS:
            return True
        frame = frame.f_back
    return False


def _repeat() -> None:
    """Let Python handle Ctrl-C once more; it does not count as a second one."""
    _state.repeated += 1
    _thread.interrupt_main()


def _terminate(number: int, frame: FrameType | None) -> None:
    """Handle SIGTERM as Ctrl-C is handled at this moment."""
    _state.terminated = True
    handler = signal.getsignal(signal.SIGINT)
    if callable(handler):
        handler(signal.SIGINT, frame)
    else:
        _interrupt(signal.SIGINT, frame)


def _answer(reader: int) -> None:
    """Print at once what the command waits for; end the process shortly after a second signal."""
    while True:
        for number in os.read(reader, 16):
            if number not in (signal.SIGINT, signal.SIGTERM):
                continue
            if _state.repeated:
                _state.repeated -= 1
                continue
            _state.signals += 1
            _state.terminated |= number == signal.SIGTERM
            if _state.signals > 1:
                timer = threading.Timer(GRACE, _leave)
                timer.daemon = True
                timer.start()
            elif _state.waits is not None or not select.select([reader], [], [], SILENCE)[0]:
                print_wait()


def _leave() -> NoReturn:
    """End this process at once. Files are written whole or not at all, so all stay complete."""
    if sys.stderr.isatty():
        sys.stderr.write("\r\x1b[2K\x1b[?25h")  # remove the live line, show the cursor
    sys.stderr.write("stopped at once\n")
    sys.stderr.flush()
    os._exit(exit_code(EXIT_INTERRUPTED))
