"""Clocks: wall and processor time, in this process and in children."""

from __future__ import annotations

import json
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
    """Return the wall and processor time of a call."""
    began, cpu = time.perf_counter(), time.process_time()
    action()
    return Time(time.perf_counter() - began, time.process_time() - cpu)


def medians(times: list[Time]) -> Time:
    """Median wall and median processor time."""
    return Time(median(t.wall for t in times), median(t.cpu for t in times))


LAUNCHER = """
import json, resource, subprocess, sys, time
began = time.perf_counter()
code = subprocess.run(sys.argv[1:], stdout=subprocess.DEVNULL).returncode
wall, used = time.perf_counter() - began, resource.getrusage(resource.RUSAGE_CHILDREN)
print(json.dumps([code, wall, used.ru_utime + used.ru_stime, used.ru_maxrss]))
"""
"""Starts a command from a process of its own: what a process is started from counts as its peak
memory, if that is the larger."""


def run_child(command: list[str]) -> tuple[Time, int]:
    """Time and peak memory (bytes) of a command run from the repository's root.

    Its Python keeps compiled modules, as an installed package has them, whatever the caller's does.

    Raises:
        RuntimeError: it failed.
    """
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"}
    launch = [sys.executable, "-S", "-c", LAUNCHER, *command]
    done = subprocess.run(launch, cwd=ROOT, env=environment, capture_output=True, text=True)
    code, wall, cpu, peak = json.loads(done.stdout)
    if code != 0:
        raise RuntimeError(f"{' '.join(command)} failed: {done.stderr[-800:]}")
    return Time(wall, cpu), peak * BYTES_PER_MAXRSS
