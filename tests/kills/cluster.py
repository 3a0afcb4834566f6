"""A Dask scheduler of this machine with one worker, which can be killed and replaced."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from pathlib import Path

LONGEST_START = 300.0
"""Longest time (s) until the scheduler runs; on a busy machine it takes half a minute."""


class Cluster:
    """A scheduler and a worker, each a process of its own."""

    def __init__(self, home: Path) -> None:
        """Start both; the worker finds the user's objectives where the command runs.

        Raises:
            RuntimeError: the scheduler does not start.
        """
        self._home = home
        told = home / "scheduler.json"
        self._scheduler = self._begin("dask_scheduler", "--port", "0", "--scheduler-file", told)
        until = time.monotonic() + LONGEST_START
        while not told.exists():
            if self._scheduler.poll() is not None or time.monotonic() > until:
                raise RuntimeError("the Dask scheduler did not start")
            time.sleep(0.1)
        self.address: str = json.loads(told.read_text())["address"]
        self._worker = self._begin_worker()

    def replace_worker(self) -> None:
        """Kill the worker, and start another one."""
        _end(self._worker)
        self._worker = self._begin_worker()

    def end(self) -> None:
        """End both."""
        _end(self._worker)
        _end(self._scheduler)

    def _begin_worker(self) -> subprocess.Popen[bytes]:
        more = ("--nthreads", "1", "--no-nanny", "--local-directory", self._home / "dask")
        return self._begin("dask_worker", self.address, *more)

    def _begin(self, program: str, *words: str | Path) -> subprocess.Popen[bytes]:
        search = os.pathsep.join(each or str(Path.cwd()) for each in sys.path)
        return subprocess.Popen(
            [sys.executable, "-m", f"distributed.cli.{program}", *map(str, words),
             "--host", "127.0.0.1", "--no-dashboard"],
            stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
            cwd=self._home, env={**os.environ, "PYTHONPATH": search},
        )  # fmt: skip


def _end(process: subprocess.Popen[bytes]) -> None:
    process.kill()
    process.wait()
