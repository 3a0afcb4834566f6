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
"""Number of bytes in a unit of ``ru_maxrss`` of getrusage: bytes on macOS, KiB on Linux."""


@dataclass(frozen=True)
class Time:
    """Duration of an action.

    On an idle machine of n cores, the wall time is at least cpu / n; if it is much longer, another
    program was running.

    Attributes:
        wall: wall time, s.
        cpu: processor time of all threads, s.
    """

    wall: float
    cpu: float


def timed(action: Callable[[], object]) -> Time:
    """Return the wall and processor time of a call."""
    began, cpu = time.perf_counter(), time.process_time()
    action()
    return Time(time.perf_counter() - began, time.process_time() - cpu)


def medians(times: list[Time]) -> Time:
    """Return the median wall time and the median processor time."""
    return Time(median(t.wall for t in times), median(t.cpu for t in times))


LAUNCHER = """
import json, resource, subprocess, sys, time
began = time.perf_counter()
code = subprocess.run(sys.argv[1:], stdout=subprocess.DEVNULL).returncode
wall, used = time.perf_counter() - began, resource.getrusage(resource.RUSAGE_CHILDREN)
print(json.dumps([code, wall, used.ru_utime + used.ru_stime, used.ru_maxrss]))
"""
"""Program that starts a command from a small process, since the memory of the starting process
counts as the peak of the started one."""


def run_child(command: list[str]) -> tuple[Time, int]:
    """Run a command in the repository's root, and return its time and peak memory (bytes).

    Its Python keeps compiled modules, as an installed package does.
    """
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"}
    launch = [sys.executable, "-S", "-c", LAUNCHER, *command]
    done = subprocess.run(launch, cwd=ROOT, env=environment, capture_output=True, text=True)
    code, wall, cpu, peak = json.loads(done.stdout)
    if code != 0:
        raise RuntimeError(f"{' '.join(command)} failed: {done.stderr[-800:]}")
    return Time(wall, cpu), peak * BYTES_PER_MAXRSS
