"""Requests in progress."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Mapping
from typing import Any

from optisense.design import SensorDesign
from optisense.engine.failures import Cancelled
from optisense.engine.protocol import RequestId

EVENTS_EVERY = 0.1
"""Shortest interval between two progress events of a request, s: as fast as people follow."""

LONGEST_WAIT = 3.0
"""Longest time that a render waits for short work at each of its safe points, s: that of an import
of a large package; other short work takes less."""

PAUSE = 0.002
"""Time that a render leaves to other threads at a safe point, s, enough to read a request."""

PAUSE_EVERY = 0.05
"""Time between two such pauses at least, s; a draft has six safe points in a tenth of a second."""

Send = Callable[[Mapping[str, Any]], None]


class PriorityGate:
    """Gate that lets short work go first.

    The renderer holds Python's lock while it waits for its kernels. Another thread gets a turn only
    now and then, and importing a package, which takes hundreds of turns, would take a minute. So a
    render stops at its safe points until the short work is done.
    """

    def __init__(self) -> None:
        """Open the gate: no short work is in progress."""
        self._count = 0
        self._paused = 0.0
        self._changed = threading.Condition()

    def __enter__(self) -> None:
        """Begin short work; from any thread."""
        with self._changed:
            self._count += 1

    def __exit__(self, *_: object) -> None:
        """End short work."""
        with self._changed:
            self._count -= 1
            self._changed.notify_all()

    def wait_for_short_jobs(self) -> None:
        """Wait until no short work is in progress, or for `LONGEST_WAIT`."""
        if time.monotonic() - self._paused >= PAUSE_EVERY:
            time.sleep(PAUSE)  # the thread that reads requests may have one
            self._paused = time.monotonic()
        with self._changed:
            self._changed.wait_for(lambda: self._count == 0, LONGEST_WAIT)


class Job:
    """Request in progress, through which its handler reports.

    Attributes:
        id: id of the request.
        draft: whether a newer one of its kind replaces it while it waits.
        design: design of the request, once it is read; errors look the part up in it.
    """

    def __init__(
        self,
        number: RequestId,
        send: Send,
        draft: bool = False,
        wait_for_short_jobs: Callable[[], None] | None = None,
    ) -> None:
        """Store a request whose work has not begun.

        `wait_for_short_jobs` is called at its safe points.
        """
        self._wait_for_short_jobs = wait_for_short_jobs
        self.id = number
        self.draft = draft
        self.design: SensorDesign | None = None
        self._send = send
        self._cancelled = threading.Event()
        self._last_event = -1.0
        self._on_cancel: list[Callable[[bool], None]] = []
        self._leaving = False
        self._lock = threading.Lock()

    def send(self, event: str, **content: Any) -> None:
        """Send an event."""
        self._send({"id": self.id, "event": event, **content})

    def progress(self, fraction: float, text: str, **content: Any) -> None:
        """Send the progress, if the last event is old enough. This is a safe point, where a
        cancelled request ends.

        Raises:
            Cancelled: the request was cancelled.
        """
        if self._wait_for_short_jobs is not None:
            self._wait_for_short_jobs()
        self.check()
        now = time.monotonic()
        if now - self._last_event >= EVENTS_EVERY:
            self._last_event = now
            self.send("progress", fraction=round(fraction, 4), text=text, **content)

    def check(self) -> None:
        """Raise Cancelled if the request was cancelled: a safe point."""
        if self._cancelled.is_set():
            raise Cancelled

    def cancel(self, leaving: bool = False) -> None:
        """Cancel the request; a second call repeats the signal to its hooks.

        Args:
            leaving: True if the engine ends, False if the front end asked for it.
        """
        with self._lock:
            self._cancelled.set()
            self._leaving |= leaving
            hooks = list(self._on_cancel)
        for hook in hooks:
            hook(leaving)

    def on_cancel(self, hook: Callable[[bool], None]) -> None:
        """Call a function, with `leaving`, at each `cancel`, also for a cancel before this call."""
        with self._lock:
            self._on_cancel.append(hook)
            late, leaving = self._cancelled.is_set(), self._leaving
        if late:
            hook(leaving)

    @property
    def cancelled(self) -> bool:
        """True if the request was cancelled."""
        return self._cancelled.is_set()
