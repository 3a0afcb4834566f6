"""Clocks: wall and processor time, in this process and in children."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from statistics import median

ROOT = Path(__file__).parent.parent
BYTES_PER_MAXRSS = 1 if sys.platform == "darwin" else 1024


@dataclass(frozen=True)
class Time:
    """Wall seconds, and processor seconds of all threads.

    On an idle machine of n cores wall is at least cpu / n; where it is much more, something
    else was running.
    """

    wall: float
    cpu: float


def timed(action: Callable[[], object]) -> Time:
    """How long a call takes."""
    began, cpu = time.perf_counter(), time.process_time()
    action()
    return Time(time.perf_counter() - began, time.process_time() - cpu)


def medians(times: list[Time]) -> Time:
    """Median wall and median processor time."""
    return Time(median(t.wall for t in times), median(t.cpu for t in times))


def run_child(command: list[str]) -> tuple[Time, int]:
    """Time and peak memory (bytes) of a command run from the repository's root.

    Its Python keeps compiled modules, as an installed package has them, whatever the caller's does.

    Raises:
        RuntimeError: it failed.
    """
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"}
    began = time.perf_counter()
    child = subprocess.Popen(
        command,
        cwd=ROOT,
        env=environment,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert child.stderr is not None
    errors = child.stderr.read()
    _, status, usage = os.wait4(child.pid, 0)
    wall = time.perf_counter() - began
    child.returncode = os.waitstatus_to_exitcode(status)
    if child.returncode != 0:
        raise RuntimeError(f"{' '.join(command)} failed: {errors[-800:]}")
    return Time(wall, usage.ru_utime + usage.ru_stime), usage.ru_maxrss * BYTES_PER_MAXRSS
