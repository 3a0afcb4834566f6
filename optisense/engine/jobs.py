"""A request that is being worked on, and the lines in which requests wait."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable, Mapping
from typing import Any, Protocol

from optisense.design import SensorDesign
from optisense.engine.failures import Cancelled
from optisense.engine.protocol import RequestId

EVENTS_EVERY = 0.1
"""Seconds between two progress events of a request; a person does not follow more."""

LONGEST_WAIT = 3.0
"""Seconds that a render waits for short work at each of its safe points."""

GLANCE = 0.002
"""Seconds that it always leaves to the other threads there."""

Send = Callable[[Mapping[str, Any]], None]


class PriorityGate:
    """Lets short work go first.

    The renderer keeps Python's lock while it waits for its kernels. Another thread gets a turn only
    now and then, and importing a package, which takes hundreds of turns, would take a minute. So a
    render stops at its safe points until the short work is done.
    """

    def __init__(self) -> None:
        """Nothing is being done."""
        self._count = 0
        self._changed = threading.Condition()

    def __enter__(self) -> None:
        """Begin with short work; from any thread."""
        with self._changed:
            self._count += 1

    def __exit__(self, *_: object) -> None:
        """It is done."""
        with self._changed:
            self._count -= 1
            self._changed.notify_all()

    def give_way(self) -> None:
        """Wait until no short work is being done, or for `LONGEST_WAIT`."""
        time.sleep(GLANCE)  # the thread that reads requests may have one
        with self._changed:
            self._changed.wait_for(lambda: self._count == 0, LONGEST_WAIT)


class Job:
    """A request that is being worked on: its handler reports through it.

    Attributes:
        id: of the request.
        draft: whether a newer one of its kind replaces it while it waits.
        design: what it is about, once that is read; errors find the part in it.
    """

    def __init__(
        self,
        number: RequestId,
        send: Send,
        draft: bool = False,
        give_way: Callable[[], None] | None = None,
    ) -> None:
        """A request that nobody has begun with; `give_way` is called at its safe points."""
        self._give_way = give_way
        self.id = number
        self.draft = draft
        self.design: SensorDesign | None = None
        self._send = send
        self._cancelled = threading.Event()
        self._told = -1.0
        self._on_cancel: list[Callable[[bool], None]] = []
        self._leaving = False
        self._lock = threading.Lock()

    def send(self, event: str, **content: Any) -> None:
        """Send an event."""
        self._send({"id": self.id, "event": event, **content})

    def progress(self, fraction: float, text: str, **content: Any) -> None:
        """Send how far it is, not too often; a safe point, where a cancelled request ends.

        Raises:
            Cancelled: it was cancelled.
        """
        if self._give_way is not None:
            self._give_way()
        self.check()
        now = time.monotonic()
        if now - self._told >= EVENTS_EVERY:
            self._told = now
            self.send("progress", fraction=round(fraction, 4), text=text, **content)

    def check(self) -> None:
        """A safe point.

        Raises:
            Cancelled: it was cancelled.
        """
        if self._cancelled.is_set():
            raise Cancelled

    def cancel(self, leaving: bool = False) -> None:
        """Ask for it to be given up; called again, ask once more.

        Args:
            leaving: nobody asked for it, but the engine ends.
        """
        with self._lock:
            self._cancelled.set()
            self._leaving |= leaving
            hooks = list(self._on_cancel)
        for hook in hooks:
            hook(leaving)

    def on_cancel(self, hook: Callable[[bool], None]) -> None:
        """Call something, with `leaving`, at each `cancel`; for one that has come already too."""
        with self._lock:
            self._on_cancel.append(hook)
            late, leaving = self._cancelled.is_set(), self._leaving
        if late:
            hook(leaving)

    @property
    def cancelled(self) -> bool:
        """Whether it was asked to end."""
        return self._cancelled.is_set()


class Task(Protocol):
    """A job with its work, ready to run."""

    @property
    def job(self) -> Job:
        """What is known of it."""

    def run(self) -> None:
        """Do the work and answer; raises nothing."""

    def give_up(self, kind: str) -> None:
        """Answer without having done it: "Cancelled" or "Replaced"."""


class JobQueue:
    """Requests that are done one after another, in a thread of their own.

    Drafts wait in a place of their own, which only the newest one has, and give way to whatever
    else waits.
    """

    def __init__(self, name: str) -> None:
        """Start the thread."""
        self._waiting: deque[Task] = deque()
        self._draft: Task | None = None
        self._changed = threading.Condition()
        threading.Thread(target=self._work, name=name, daemon=True).start()

    def put(self, task: Task) -> None:
        """Let a task wait for its turn."""
        replaced: Task | None = None
        with self._changed:
            if task.job.draft:
                replaced, self._draft = self._draft, task
            else:
                self._waiting.append(task)
            self._changed.notify()
        if replaced is not None:
            replaced.give_up("Replaced")

    def drop(self, job: Job) -> bool:
        """Take a task out that still waits, and answer it; false where it has begun."""
        found: Task | None = None
        with self._changed:
            if self._draft is not None and self._draft.job is job:
                found, self._draft = self._draft, None
            for task in list(self._waiting):
                if task.job is job:
                    found = task
                    self._waiting.remove(task)
        if found is not None:
            found.give_up("Cancelled")
        return found is not None

    def _work(self) -> None:
        while True:
            self._next().run()

    def _next(self) -> Task:
        with self._changed:
            while not self._waiting and self._draft is None:
                self._changed.wait()
            if self._waiting:
                return self._waiting.popleft()
            task, self._draft = self._draft, None
            assert task is not None
            return task
