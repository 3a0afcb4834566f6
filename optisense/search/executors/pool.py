"""A pool of processes on this machine.

Python's own pool fails as a whole when one of its processes dies, and starts processes as copies of
the calling program. Here each worker has its own pipe, so that a death interrupts only the trial in
progress, which another worker takes over.
"""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
import tempfile
import threading
from collections import deque
from concurrent.futures import Future
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from optisense.errors import OptiSenseError, SearchError, SetupError
from optisense.search.evaluation.evaluator import Evaluator
from optisense.search.evaluation.outcome import Outcome
from optisense.search.executors.base import Runner, pickled, receive, send

MOST_DEATHS = 2
"""Number of workers that may die during one trial; a trial at which so many died fails, as it is
probably the cause. One death can have another cause, such as the system's out-of-memory killer.
"""

ONE_THREAD = dict.fromkeys(
    ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS"), "1"
)
"""Environment variables that give each worker one thread for linear algebra. Its matrices are
small, and the threads of many workers would wait for each other.
"""

STDERR_TAIL = 2000
"""Number of bytes at the end of a dead worker's output that are searched for its last line, which
names the reason; error messages are shorter.
"""


def processors() -> int:
    """Return the number of processors that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@dataclass
class _Task:
    """Trial: its point (n,), its seed, its future, and the number of workers that it has killed."""

    vector: NDArray[np.float64]
    seed: int
    future: Future[Outcome]
    deaths: int = 0


@dataclass
class _Worker:
    """Worker process and its state."""

    process: subprocess.Popen[bytes]
    ready: bool = False
    task: _Task | None = None

    def ask(self, message: Any) -> Any:
        """Send a message to the worker and wait for the answer."""
        assert self.process.stdin is not None and self.process.stdout is not None
        send(self.process.stdin, message)
        return receive(self.process.stdout)


class ProcessPool(Runner):
    """Pool of worker processes on this machine, each with its share of the processor's threads."""

    def __init__(self, evaluator: Evaluator, workers: int, threads: int | None = None) -> None:
        """Start a number of workers, which get ready in the background; SearchError if the number
        is below 1, or if the evaluator can't be pickled. The renderer of each has a number of
        threads, which is the worker's share of the processors if `threads` is None.
        """
        if workers < 1:
            raise SearchError(f"the number of workers is {workers}", hint="Give 1 or more")
        self.window = 4 * workers
        self._blob = pickled(evaluator)
        self._threads = threads or max(1, processors() // workers)
        self._waiting: deque[_Task] = deque()
        self._changed = threading.Condition()
        self._closed = False
        self._error: Exception | None = None
        self._processes: dict[int, subprocess.Popen[bytes]] = {}
        for place in range(workers):
            threading.Thread(target=self._supervise, args=(place,), daemon=True).start()

    def submit(self, vector: NDArray[np.float64], seed: int) -> Future[Outcome]:
        """Submit the trial of a point (n,) to the next free worker; see `Runner.submit`."""
        task = _Task(vector, seed, Future())
        with self._changed:
            if self._error is not None:
                task.future.set_exception(self._error)
            else:
                self._waiting.append(task)
                self._changed.notify()
        return task.future

    def close(self) -> None:
        """End the workers."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()
            processes = list(self._processes.values())
        for process in processes:
            process.kill()
        for process in processes:
            process.wait()

    def _supervise(self, place: int) -> None:
        """Keep one place of the pool filled: start a new worker when the one there dies."""
        failed_starts = 0
        try:
            while failed_starts < MOST_DEATHS:
                with tempfile.TemporaryFile() as stderr:
                    process = self._start(place, stderr)
                    if process is None:
                        return
                    worker = _Worker(process)
                    try:
                        self._serve(worker)
                        return
                    except (EOFError, OSError):
                        code = process.wait()
                        if self._closed:
                            return
                        if not worker.ready and code >= 0:  # it exited by itself, as others would
                            raise _never_ready(code, _tail(stderr)) from None
                        failed_starts = 0 if worker.ready else failed_starts + 1
                        if worker.task is not None:
                            self._on_death(worker.task, code, _tail(stderr))
                    finally:
                        self._stop(place, process)
            raise _never_ready(code, "")
        except OptiSenseError as error:
            self._give_up(error)
        except OSError as error:
            self._give_up(SetupError(f"a worker could not be started: {error}"))

    def _serve(self, worker: _Worker) -> None:
        """Prepare a worker and give it tasks until the pool is closed or the worker dies."""
        kind, content = worker.ask((self._blob, self._threads))
        if kind == "setup-error":
            raise content
        worker.ready = True
        while (task := self._next()) is not None:
            worker.task = task
            kind, content = worker.ask((task.vector, task.seed))
            worker.task = None
            if kind == "done":
                task.future.set_result(content)
            else:
                task.future.set_exception(content)

    def _start(self, place: int, stderr: IO[bytes]) -> subprocess.Popen[bytes] | None:
        environment = {**os.environ, **ONE_THREAD}
        environment["PYTHONPATH"] = os.pathsep.join(path or str(Path.cwd()) for path in sys.path)
        session: dict[str, Any] = {"start_new_session": True}  # Ctrl-C is handled by the pool
        if sys.platform == "win32":
            session = {"creationflags": subprocess.CREATE_NEW_PROCESS_GROUP}
        with self._changed:
            if self._closed or self._error is not None:
                return None
            process = subprocess.Popen(
                [sys.executable, "-m", "optisense.search.executors._worker"],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=stderr,
                env=environment,
                **session,
            )
            self._processes[place] = process
            return process

    def _next(self) -> _Task | None:
        """Return the next task, or None if the pool is closed."""
        with self._changed:
            while not self._waiting and not self._closed and self._error is None:
                self._changed.wait()
            if self._closed or self._error is not None:
                return None
            return self._waiting.popleft()

    def _on_death(self, task: _Task, code: int, stderr: str) -> None:
        """Give the task of a dead worker to another one, or fail it if it has killed too many."""
        task.deaths += 1
        if task.deaths < MOST_DEATHS:
            with self._changed:
                self._waiting.appendleft(task)
                self._changed.notify()
            return
        reason = f"its worker died {task.deaths} times ({_exit(code)}{stderr and ': ' + stderr})"
        task.future.set_result(Outcome({}, reason))

    def _give_up(self, error: Exception) -> None:
        """Fail all tasks with this error, because no worker can work."""
        with self._changed:
            self._error = error
            tasks = list(self._waiting)
            self._waiting.clear()
            self._changed.notify_all()
        for task in tasks:
            task.future.set_exception(error)

    def _stop(self, place: int, process: subprocess.Popen[bytes]) -> None:
        process.kill()
        process.wait()
        for stream in (process.stdin, process.stdout):
            with contextlib.suppress(OSError):
                if stream is not None:
                    stream.close()
        with self._changed:
            if self._processes.get(place) is process:
                del self._processes[place]


def _never_ready(code: int, stderr: str) -> SetupError:
    return SetupError(
        f"a worker could not be started ({_exit(code)}{stderr and ': ' + stderr})",
        hint="`optisense doctor` checks this machine",
    )


def _exit(code: int) -> str:
    return f"signal {-code}" if code < 0 else f"exit code {code}"


def _tail(stderr: IO[bytes]) -> str:
    """Return the last line of a worker's output."""
    size = stderr.seek(0, os.SEEK_END)
    stderr.seek(max(0, size - STDERR_TAIL))
    lines = stderr.read().decode("utf-8", "replace").strip().splitlines()
    return lines[-1].strip() if lines else ""
