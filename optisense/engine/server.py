"""The engine: it reads requests, puts them into their queues, and answers each exactly once."""

from __future__ import annotations

import faulthandler
import os
import sys
import threading
import time
import traceback
from collections import deque
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import IO, Any, NoReturn

from optisense import __version__
from optisense.engine import requests
from optisense.engine.failures import Cancelled, ProtocolError, as_data
from optisense.engine.jobs import Job
from optisense.engine.protocol import (
    MOST_OF_A_LINE,
    PROTOCOL,
    Channel,
    Fields,
    Request,
    RequestId,
    answer,
    checked_fields,
    read_request,
    refusal,
)
from optisense.engine.requests import Kind, Lane
from optisense.engine.session import Session
from optisense.errors import OptiSenseError, OutputError
from optisense.untrusted_files import is_folder

SHUTDOWN_WAIT = 3.0
"""Longest time that the engine waits at its end, s, for answers to the requests in progress: more
than the time between two safe points of a render, and short enough for a user who closes a window.
"""

AT_ONCE = ("hello", "cancel", "shutdown")
"""Requests that are carried out without a queue."""


class Hello(Fields):
    """Fields of the request "hello"; see docs/engine.md."""

    protocol: int
    client: str = ""
    folder: str
    variant: str = "auto"


class Cancel(Fields):
    """Fields of the request "cancel"; see docs/engine.md."""

    of: int | str


class Engine:
    """Server of one front end."""

    def __init__(self, channel: Channel) -> None:
        """Start the queues; nothing is loaded yet."""
        self.session = Session()
        self._channel = channel
        self._lines = {lane: _Queue(lane.value) for lane in (Lane.QUICK, Lane.RENDER)}
        self._open: dict[RequestId, Job] = {}
        self._changed = threading.Condition()
        self._ending = False

    def serve(self, requests_in: IO[bytes]) -> None:
        """Read requests until there are no more, or `shutdown` comes."""
        while not self._ending and not self._channel.gone:
            line = requests_in.readline(MOST_OF_A_LINE + 1)
            if not line:
                break
            whole = line
            while not line.endswith(b"\n") and line:  # too long, or the last one
                line = requests_in.readline(MOST_OF_A_LINE)
            if whole.strip():
                self._take(whole)
        if self._channel.gone:  # nobody reads the answers
            self._cancel_all()
        elif not self._ending:
            self._give_up_all()

    def _take(self, line: bytes) -> None:
        """Begin a request, or answer why it can't be."""
        number: RequestId | None = None
        try:
            request = read_request(line)
            number = request.id
            with self._changed:
                taken = number in self._open
            if taken:
                number = None  # the answer to this id belongs to the other request
                raise ProtocolError(
                    f"a request with the id {request.id!r} is still open",
                    where="id",
                    hint="Give each request an id of its own",
                )
            self._begin(request)
        except ProtocolError as error:
            known = error.request if number is None and error.request is not None else number
            self._channel.send(refusal(known, as_data(error)))
        except Exception as error:
            self._channel.send(refusal(number, as_data(error)))
            traceback.print_exc()

    def _begin(self, request: Request) -> None:
        if request.do == "hello":
            self._hello(request)
            return
        if self.session.folder is None:
            raise ProtocolError(
                f"'{request.do}' came before 'hello'",
                hint="Send the request 'hello' first, and wait for its answer",
            )
        if request.do == "cancel":
            self._cancel(request)
        elif request.do == "shutdown":
            self._shutdown(request)
        else:
            self._enter(request)

    def _enter(self, request: Request) -> None:
        """Put a request into its queue."""
        kind = requests.find(request.do, AT_ONCE)
        fields = checked_fields(kind.fields, request)
        job = Job(
            request.id,
            self._channel.send,
            draft=bool(getattr(fields, "draft", False)),
            wait_for_short_jobs=self.session.priority_gate.wait_for_short_jobs
            if kind.lane is Lane.RENDER
            else None,
        )
        with self._changed:
            self._open[request.id] = job
        task = _Work(self, kind, fields, job)
        if kind.lane is Lane.OWN:
            threading.Thread(target=task.run, name=kind.do, daemon=True).start()
        else:
            self._lines[kind.lane].put(task)

    def _hello(self, request: Request) -> None:
        version = request.fields.get("protocol")
        if version != PROTOCOL or isinstance(version, bool):
            raise ProtocolError(
                f"the front end speaks protocol {version!r}, this engine (OptiSense "
                f"{__version__}) protocol {PROTOCOL}",
                where="protocol",
                hint="Install versions of the front end and of OptiSense that belong together",
            )
        fields = checked_fields(Hello, request)
        if fields.variant not in ("auto", "llvm", "cuda"):
            raise ProtocolError(
                f"there is no variant '{fields.variant}'", where="variant",
                hint="Use auto, llvm or cuda",
            )  # fmt: skip
        folder = Path(fields.folder)
        if not folder.is_absolute() or not is_folder(folder):
            error = OutputError(
                "there is no such folder",
                where=fields.folder,
                hint="Make the folder first, and give its absolute path",
            )
            self._channel.send(refusal(request.id, as_data(error)))
            return
        self.session.folder = folder
        self.session.renderer.variant = fields.variant
        facts = {
            "protocol": PROTOCOL,
            "version": __version__,
            "pid": os.getpid(),
            "folder": str(folder),
        }
        self._channel.send(answer(request.id, facts))

    def _cancel(self, request: Request) -> None:
        fields = checked_fields(Cancel, request)
        with self._changed:
            job = self._open.get(fields.of)
        if job is not None:
            job.cancel()
            for line in self._lines.values():
                if line.drop(job):
                    break
        self._channel.send(answer(request.id, {"cancelled": job is not None}))

    def _shutdown(self, request: Request) -> None:
        checked_fields(Fields, request)
        self._ending = True
        self._give_up_all()
        self._channel.send(answer(request.id, {}))

    def _give_up_all(self) -> None:
        """Cancel all open requests, and wait `SHUTDOWN_WAIT` seconds for their answers."""
        self._cancel_all()
        until = time.monotonic() + SHUTDOWN_WAIT
        with self._changed:
            while self._open and (left := until - time.monotonic()) > 0:
                self._changed.wait(left)

    def _cancel_all(self) -> None:
        with self._changed:
            jobs = list(self._open.values())
        for job in jobs:
            job.cancel(leaving=True)
            for line in self._lines.values():
                line.drop(job)

    def answered(self, job: Job, message: Mapping[str, Any]) -> None:
        """Send the answer to a request, after which its id is free."""
        with self._changed:
            if self._open.pop(job.id, None) is None:
                return
            self._channel.send(message)
            self._changed.notify_all()


class _Work:
    """Request with all that it needs to run."""

    def __init__(self, engine: Engine, kind: Kind, fields: Fields, job: Job) -> None:
        self._engine = engine
        self._kind = kind
        self._fields = fields
        self.job = job
        self._short = kind.lane is Lane.QUICK
        if self._short:
            engine.session.priority_gate.__enter__()

    def run(self) -> None:
        """Carry out the request and answer."""
        session = self._engine.session
        try:
            self.job.check()
            result = self._kind.handler(session, self._fields, self.job)
        except (OptiSenseError, Cancelled, OSError, MemoryError) as error:
            self._refuse(as_data(error, self.job.design))
        except BaseException as error:
            traceback.print_exc()
            if self._kind.lane is Lane.RENDER:
                session.renderer.forget()
            self._refuse(as_data(error, self.job.design))
        else:
            self._answer(answer(self.job.id, result))

    def give_up(self, kind: str) -> None:
        """Answer the request without carrying it out."""
        error = as_data(Cancelled())
        if kind == "Replaced":
            error |= {"kind": kind, "message": "a newer draft has replaced the request"}
        self._refuse(error)

    def _refuse(self, error: dict[str, Any]) -> None:
        self._answer(refusal(self.job.id, error))

    def _answer(self, message: Mapping[str, Any]) -> None:
        if self._short:
            self._engine.session.priority_gate.__exit__()
        self._engine.answered(self.job, message)


class _Queue:
    """Queue of requests that are carried out one after another, in a thread of its own.

    A draft waits in a separate place, which holds only the newest one, and other requests go first.
    """

    def __init__(self, name: str) -> None:
        """Start the thread."""
        self._waiting: deque[_Work] = deque()
        self._draft: _Work | None = None
        self._changed = threading.Condition()
        threading.Thread(target=self._work, name=name, daemon=True).start()

    def put(self, task: _Work) -> None:
        """Queue a task."""
        replaced: _Work | None = None
        with self._changed:
            if task.job.draft:
                replaced, self._draft = self._draft, task
            else:
                self._waiting.append(task)
            self._changed.notify()
        if replaced is not None:
            replaced.give_up("Replaced")

    def drop(self, job: Job) -> bool:
        """Remove a task that still waits, and answer it; False if it has begun."""
        found: _Work | None = None
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

    def _next(self) -> _Work:
        with self._changed:
            while not self._waiting and self._draft is None:
                self._changed.wait()
            if self._waiting:
                return self._waiting.popleft()
            task, self._draft = self._draft, None
            assert task is not None
            return task


def serve(interrupted: Callable[[], int] = lambda: 130) -> NoReturn:
    """Serve the front end at standard input and output, and end the process with it.

    Args:
        interrupted: function that returns the exit code after Ctrl-C or SIGTERM.
    """
    faulthandler.enable()
    channel = Channel.of_standard_output()
    code = 0
    try:
        Engine(channel).serve(sys.stdin.buffer)
    except KeyboardInterrupt:
        code = interrupted()
    finally:
        channel.close()
        sys.stderr.flush()
        # Threads may be in the middle of a render, which can't be waited for.
        os._exit(code)
