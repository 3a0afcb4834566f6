"""The engine as a child process: requests and answers are lines of JSON, and nothing waits.

The owner of an `Engine` calls `poll` regularly, and callbacks run there. There are no threads:
Blender looks up its context without holding Python's lock while an operator runs, and crashes now
and then if another Python thread runs meanwhile. Therefore the engine answers into a file, which
can be read without waiting on every operating system, and requests wait in memory while the
engine's pipe is full.
"""

from __future__ import annotations

import contextlib
import json
import os
import shlex
import subprocess
import sys
import tempfile
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

PROTOCOL = 1
"""Version of the protocol that this client speaks; see docs/engine.md."""
CLIENT = "optisense-blender 0.2.0"
SHUTDOWN_SECONDS = 2.0
"""Time that the engine may take to end by itself before it is killed, s."""
GREETING_SECONDS = 30.0
"""Time that the engine may take to greet, s; it greets before it loads any large library."""
ELSEWHERE = "Set the engine's path in the preferences of the extension"
LOG_LINES = 40
"""Number of lines of the engine's log that are kept, to be shown if it dies."""
PIECE = 1 << 16
"""Number of bytes that are written to the engine at once: the capacity of a pipe on Linux."""

Answer = Callable[[dict[str, Any]], None]


class EngineError(Exception):
    """Error of the engine, or of its process, with texts for the user.

    Attributes:
        kind: kind of the error, as the engine names it; `EngineGone` if the process ended.
        message, where, hint: description of the error, its place, and what to do about it.
        path: dotted path in the design, if known.
        part: part of the design that the error is about, if known.
        contact: number of the contact that the error is about, from 0; None if it is about none.
    """

    def __init__(self, error: dict[str, Any]) -> None:
        super().__init__(error.get("message") or "the engine failed")
        self.kind: str = error.get("kind") or "InternalError"
        self.message: str = str(self)
        self.where: str | None = error.get("where")
        self.hint: str | None = error.get("hint")
        self.path: str | None = error.get("path")
        self.part: str | None = error.get("part")
        self.contact: int | None = error.get("contact")

    def text(self) -> str:
        """Return message, place and hint in one line."""
        where = f" ({self.where})" if self.where else ""
        hint = f". {self.hint[:1].upper()}{self.hint[1:]}" if self.hint else ""
        return f"{self.message[:1].upper()}{self.message[1:]}{where}{hint}"


@dataclass
class Request:
    """Request that was sent to the engine."""

    number: int
    what: str
    on_result: Answer
    on_error: Callable[[EngineError], None]
    on_event: Answer
    done: bool = field(default=False)

    def ignore(self) -> None:
        """Drop the callbacks: the answer is read and discarded."""
        self.on_result = self.on_error = self.on_event = _nothing


def _nothing(_: Any) -> None:
    pass


class _Lines:
    """Reader of the lines that a process writes into a temporary file."""

    def __init__(self, folder: str, prefix: str) -> None:
        handle, name = tempfile.mkstemp(prefix=prefix, suffix=".log", dir=folder)
        self.end = os.fdopen(handle, "wb")
        self._path = Path(name)
        self._read = 0
        self._rest = b""

    def new(self) -> list[str]:
        """Return the lines that were completed since the last call."""
        with contextlib.suppress(OSError), self._path.open("rb") as file:
            file.seek(self._read)
            came = file.read()
            self._read += len(came)
            self._rest += came
        *lines, self._rest = self._rest.split(b"\n")
        return [line.decode("utf-8", "replace").rstrip("\r") for line in lines]

    def close(self) -> None:
        """Close and delete the file."""
        self.end.close()
        with contextlib.suppress(OSError):
            self._path.unlink()


class Engine:
    """Engine that runs as a child process.

    Args:
        command: command that starts the engine, for example `["optisense", "engine"]`.
        folder: existing folder for the engine's pictures and meshes.

    Raises:
        EngineError: the process can't be started.
    """

    def __init__(self, command: list[str], folder: str) -> None:
        self.command = command
        self.version: str | None = None
        self.folder = folder
        self.log: deque[str] = deque(maxlen=LOG_LINES)
        self._requests: dict[int, Request] = {}
        self._number = 0
        self._lines: deque[str] = deque()
        self._unsent = bytearray()
        self._gone = False
        self._refusal: EngineError | None = None
        self.end: EngineError | None = None
        """Error with which the engine ended, if it was not asked to end."""
        environment = {
            name: value
            for name, value in os.environ.items()
            # Blender's own Python must not leak into the user's.
            if name not in ("PYTHONHOME", "PYTHONPATH") or not _inside_blender()
        }
        self._answers, self._errors = _Lines(folder, "answers-"), _Lines(folder, "engine-")
        try:
            self._process = subprocess.Popen(
                command,
                bufsize=0,
                stdin=subprocess.PIPE,
                stdout=self._answers.end,
                stderr=self._errors.end,
                env=environment,
                creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
            )
        except OSError as error:
            self._close_files()
            raise EngineError(
                {
                    "kind": "EngineGone",
                    "message": f"the engine can't be started: {error.strerror or error}",
                    "where": command[0],
                    "hint": ELSEWHERE,
                }
            ) from error
        assert self._process.stdin is not None
        self._pipe = self._process.stdin
        if os.name != "nt":  # Windows waits when a request is larger than its pipe
            os.set_blocking(self._pipe.fileno(), False)
        self._started = time.monotonic()
        self._hello = self.send(
            "hello",
            protocol=PROTOCOL,
            client=CLIENT,
            folder=folder,
            on_result=self._greeted,
            on_error=self._refused,
        )

    @property
    def alive(self) -> bool:
        """Whether the engine can still answer."""
        return not self._gone and self._process.poll() is None

    @property
    def ended(self) -> bool:
        """Whether the engine has ended and all pending requests were told so."""
        return self._gone

    @property
    def waiting(self) -> bool:
        """Whether a request has no answer yet."""
        return bool(self._requests)

    @property
    def pid(self) -> int:
        """Process identifier."""
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
        """Send a request; its answer arrives in a later call of `poll`.

        Raises:
            EngineError: a number among the fields is not finite.
        """
        self._number += 1
        request = Request(self._number, what, on_result, on_error, on_event)
        try:
            line = json.dumps({"id": request.number, "do": what, **fields}, allow_nan=False)
        except ValueError as error:
            row = {"kind": "DesignError", "message": "a number in the scene is not finite"}
            raise EngineError(row) from error
        self._requests[request.number] = request
        self._unsent += line.encode() + b"\n"
        self._write()
        return request

    def cancel(self, request: Request) -> None:
        """Ask the engine to give a request up; it still gets an answer, which may be its result."""
        if not request.done:
            self.send("cancel", of=request.number)

    def poll(self) -> bool:
        """Run the callbacks of everything that arrived, and return whether anything did."""
        if self._gone:
            return False
        self._write()
        over = self._process.poll() is not None  # asked first: all that it wrote is read below
        self._lines.extend(self._answers.new())
        self.log.extend(self._errors.new())
        any_came = bool(self._lines)
        while self._lines:  # a callback may poll too, and take the rest
            self._take(self._lines.popleft())
        if over and not self._gone:
            self._ended()
        elif not self._hello.done and time.monotonic() - self._started > GREETING_SECONDS:
            self._refused(
                EngineError(
                    {
                        "kind": "EngineGone",
                        "message": "this program does not answer as an engine does",
                        "where": shlex.join(self.command),
                        "hint": ELSEWHERE,
                    }
                )
            )
        return any_came or over

    def wait(self, request: Request, timeout: float = 600.0) -> None:
        """Poll until a request has its answer; for scripts and tests.

        The calls block for up to `timeout` seconds.

        Raises:
            TimeoutError: there is no answer after `timeout` seconds.
        """
        end = time.monotonic() + timeout
        while not request.done:
            if not self.poll():
                if time.monotonic() > end:
                    raise TimeoutError(f"the engine did not answer '{request.what}'")
                time.sleep(0.005)

    def stop(self) -> None:
        """End the process: ask it to shut down, and kill it if it does not."""
        if self._process.poll() is None:
            self.send("shutdown")
        with contextlib.suppress(OSError):
            self._pipe.close()
        try:
            self._process.wait(SHUTDOWN_SECONDS)
        except subprocess.TimeoutExpired:
            self.kill()
        self._gone = True
        self._close_files()

    def abandon(self) -> None:
        """Report the end of a dead engine to all pending requests, even if its output was not read
        to the end.
        """
        self.poll()
        if not self._gone:
            self._ended()

    def kill(self) -> None:
        """Kill the process, which the next request finds dead."""
        self._process.kill()
        with contextlib.suppress(subprocess.TimeoutExpired):  # the system is slow to end it
            self._process.wait(SHUTDOWN_SECONDS)

    def _greeted(self, result: dict[str, Any]) -> None:
        self.version = result.get("version")

    def _refused(self, error: EngineError) -> None:
        """Fail all pending requests: the process does not speak this version of the protocol."""
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
            message = None
        if not isinstance(message, dict):  # No engine, or a library of the engine that prints.
            self.log.append(line)
            return
        request = self._requests.get(message.get("id", 0))
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
        with contextlib.suppress(OSError):
            self._pipe.close()
        self._close_files()
        last = self.log[-1] if self.log else None
        again = "Your scene is unharmed; the next request starts the engine again"
        error = EngineError(
            {
                "kind": "EngineGone",
                "message": f"the engine ended unexpectedly (exit code {self._process.returncode})",
                "where": last,
                "hint": again if self._hello.done else ELSEWHERE,
            }
        )
        self.end = self._refusal or error
        self._fail_all(self.end)

    def _write(self) -> None:
        """Write as much of the pending requests as the pipe takes."""
        try:
            while self._unsent:
                taken = self._pipe.write(self._unsent[:PIECE])
                if not taken:
                    return
                del self._unsent[:taken]
        except (OSError, ValueError):  # The process is gone; `poll` fails the pending requests.
            self._unsent.clear()

    def _close_files(self) -> None:
        self._answers.close()
        self._errors.close()


def _inside_blender() -> bool:
    return "bpy" in sys.modules
