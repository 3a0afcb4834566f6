"""The engine as a child process: JSON lines out, JSON lines in, nothing ever waits.

Threads only move lines between pipes and queues. Whoever owns an `Engine` calls `poll` now and
then, on a thread of its choice, and callbacks run there.
"""

from __future__ import annotations

import contextlib
import json
import os
import queue
import subprocess
import sys
import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

PROTOCOL = 1
CLIENT = "optisense-blender 0.1.0"
SHUTDOWN_SECONDS = 2.0
LOG_LINES = 40

Answer = Callable[[dict[str, Any]], None]


class EngineError(Exception):
    """What went wrong, for the user.

    Attributes:
        kind: as of the engine's errors; `EngineGone` where the process ended.
        message, where, hint: what is wrong, the place, what to do.
        part: the part of the design that it is about, if known.
    """

    def __init__(self, error: dict[str, Any]) -> None:
        super().__init__(error.get("message") or "the engine failed")
        self.kind: str = error.get("kind") or "InternalError"
        self.message: str = str(self)
        self.where: str | None = error.get("where")
        self.hint: str | None = error.get("hint")
        self.part: str | None = error.get("part")

    def text(self) -> str:
        """Everything in one line."""
        where = f" ({self.where})" if self.where else ""
        hint = f". {self.hint}" if self.hint else ""
        return f"{self.message[:1].upper()}{self.message[1:]}{where}{hint}"


@dataclass
class Request:
    """A request that has no answer yet."""

    number: int
    what: str
    on_result: Answer
    on_error: Callable[[EngineError], None]
    on_event: Answer
    done: bool = field(default=False)


def _nothing(_: Any) -> None:
    pass


class Engine:
    """One running engine.

    Args:
        command: how to start it, for example `["optisense", "engine"]`.
        folder: an existing folder for its pictures and meshes.

    Raises:
        EngineError: it can't be started.
    """

    def __init__(self, command: list[str], folder: str) -> None:
        self.command = command
        self.version: str | None = None
        self.folder = folder
        self.log: deque[str] = deque(maxlen=LOG_LINES)
        self._requests: dict[int, Request] = {}
        self._number = 0
        self._lines: queue.SimpleQueue[str | None] = queue.SimpleQueue()
        self._out: queue.SimpleQueue[str | None] = queue.SimpleQueue()
        self._gone = False
        self._refusal: EngineError | None = None
        environment = {
            name: value
            for name, value in os.environ.items()
            # Blender's own Python must not leak into the user's.
            if name not in ("PYTHONHOME", "PYTHONPATH") or not _inside_blender()
        }
        try:
            self._process = subprocess.Popen(
                command,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                encoding="utf-8",
                errors="replace",
                env=environment,
                creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
            )
        except OSError as error:
            raise EngineError(
                {
                    "kind": "EngineGone",
                    "message": f"the engine can't be started: {error.strerror or error}",
                    "where": command[0],
                    "hint": "Set its path in the preferences of the extension",
                }
            ) from error
        for work in (self._read, self._read_log, self._write):
            threading.Thread(target=work, daemon=True).start()
        self.send(
            "hello",
            protocol=PROTOCOL,
            client=CLIENT,
            folder=folder,
            on_result=self._greeted,
            on_error=self._refused,
        )

    @property
    def alive(self) -> bool:
        """Whether it can still answer."""
        return not self._gone and self._process.poll() is None

    @property
    def ended(self) -> bool:
        """Whether it is gone and everybody who waited was told."""
        return self._gone

    @property
    def pid(self) -> int:
        """The process's number."""
        return self._process.pid

    def send(
        self,
        what: str,
        *,
        on_result: Answer = _nothing,
        on_error: Callable[[EngineError], None] = _nothing,
        on_event: Answer = _nothing,
        **fields: Any,
    ) -> Request:
        """Ask for something; the answer comes through `poll`."""
        self._number += 1
        request = Request(self._number, what, on_result, on_error, on_event)
        self._requests[request.number] = request
        line = json.dumps({"id": request.number, "do": what, **fields}, allow_nan=False)
        self._out.put(line)
        return request

    def cancel(self, request: Request) -> None:
        """Ask that a request be given up; it still gets its answer."""
        if not request.done:
            self.send("cancel", of=request.number)

    def poll(self) -> bool:
        """Run the callbacks of all that came in; whether anything did."""
        any_came = False
        while True:
            try:
                line = self._lines.get_nowait()
            except queue.Empty:
                return any_came
            any_came = True
            if line is None:
                self._ended()
            else:
                self._take(line)

    def wait(self, request: Request, timeout: float = 600.0) -> None:
        """Poll until a request has its answer; for scripts and tests.

        Raises:
            TimeoutError: it took longer.
        """
        end = time.monotonic() + timeout
        while not request.done:
            if not self.poll():
                if time.monotonic() > end:
                    raise TimeoutError(f"the engine did not answer '{request.what}'")
                time.sleep(0.005)

    def stop(self) -> None:
        """End the process: ask, then insist."""
        if self._process.poll() is None:
            self.send("shutdown")
        self._out.put(None)
        try:
            self._process.wait(SHUTDOWN_SECONDS)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait(SHUTDOWN_SECONDS)
        self._gone = True

    def abandon(self) -> None:
        """Tell everybody who waits for a dead engine, whether or not its pipe is drained."""
        self.poll()
        if not self._gone:
            self._ended()

    def kill(self) -> None:
        """End the process at once."""
        self._process.kill()

    def _greeted(self, result: dict[str, Any]) -> None:
        self.version = result.get("version")

    def _refused(self, error: EngineError) -> None:
        """It does not speak this protocol: everybody who waits is told that."""
        self._refusal = error
        self.kill()
        self._fail_all(error)

    def _fail_all(self, error: EngineError) -> None:
        waiting, self._requests = list(self._requests.values()), {}
        for request in waiting:
            request.done = True
            request.on_error(error)

    def _take(self, line: str) -> None:
        try:
            message = json.loads(line)
        except ValueError:
            self.log.append(line)
            return
        request = self._requests.get(message.get("id"))
        if request is None:
            return
        if "ok" not in message:
            request.on_event(message)
            return
        del self._requests[request.number]
        request.done = True
        if message["ok"]:
            request.on_result(message.get("result") or {})
        else:
            request.on_error(EngineError(message.get("error") or {}))

    def _ended(self) -> None:
        self._gone = True
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(SHUTDOWN_SECONDS)
        last = self.log[-1] if self.log else None
        error = EngineError(
            {
                "kind": "EngineGone",
                "message": f"the engine ended unexpectedly (exit code {self._process.returncode})",
                "where": last,
                "hint": "Your scene is unharmed; the next request starts the engine again",
            }
        )
        self._fail_all(self._refusal or error)

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            self._lines.put(line)
        self._lines.put(None)

    def _read_log(self) -> None:
        assert self._process.stderr is not None
        for line in self._process.stderr:
            self.log.append(line.rstrip())

    def _write(self) -> None:
        assert self._process.stdin is not None
        with contextlib.suppress(OSError, ValueError):
            while (line := self._out.get()) is not None:
                self._process.stdin.write(line + "\n")
                self._process.stdin.flush()
            self._process.stdin.close()


def _inside_blender() -> bool:
    return "bpy" in sys.modules
