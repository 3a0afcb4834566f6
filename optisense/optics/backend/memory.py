"""Freed memory that the process keeps for further arrays, and limits on it."""

from __future__ import annotations

import ctypes
import gc
import os
import sys
from functools import cache
from pathlib import Path

import drjit as dr

MOST_RESIDENT = 2 * 2**30
"""Resident memory (bytes) of this process above which freed memory is returned to the system.
Tracing the light of a built-in sensor takes up to 1.5 GB, of which less than 0.4 GB are in use
afterwards."""
LEAST_FREED = 2**30
"""Growth of the resident memory (bytes) after freed memory was returned, from which on it is
returned again. A GB is less than one trace of a sensor takes, so that processes in which more than
`MOST_RESIDENT` are in use do not return memory before every image."""

_M_TRIM_THRESHOLD, _M_MMAP_MAX = -1, -4
"""The numbers of two parameters of glibc's ``mallopt``: the free memory (bytes) at the end of the
heap from which on it is returned to the system, and the most blocks outside of the heap, which are
returned when they are freed."""


@cache
def keep_freed_memory() -> None:
    """Let glibc keep freed memory for further arrays, until `bound_memory` returns it.

    By default, it returns each large array at once. The system clears each page of the next one,
    which took up to a quarter of the processor time of the first image of a sensor.
    """
    if sys.platform == "linux":
        set_option = getattr(ctypes.CDLL(None), "mallopt", None)
        if set_option is not None:
            set_option(_M_TRIM_THRESHOLD, MOST_RESIDENT - 1)  # the largest number that it takes
            set_option(_M_MMAP_MAX, 0)


class _Bound:
    """The limit that the resident memory must exceed before freed memory is returned."""

    resident: float = MOST_RESIDENT
    """Resident memory (bytes) above which freed memory is returned next."""


def bound_memory() -> None:
    """Return unused memory to the system if the process exceeds `MOST_RESIDENT`.

    Dr.Jit keeps the memory of freed arrays for new ones of the same size, and the C library keeps
    freed pages between those in use. As images need different sizes, the memory of models made in
    turn would grow without bound: a search of 40 trials took 7.5 GB, of which 1 GB was in use.
    """
    if resident() > _Bound.resident:
        dr.flush_malloc_cache()
        _trim()
        _Bound.resident = max(MOST_RESIDENT, resident() + LEAST_FREED)


def release_memory() -> None:
    """Return all unused memory to the system, including that of objects in reference cycles.

    It is meant for work that continues with another sensor: after GelSight360 and then a Mini, 0.3
    GB of 1.1 GB stay in use.
    """
    gc.collect()
    dr.sync_thread()
    dr.flush_malloc_cache()
    _trim()


def _trim() -> None:
    """Return freed pages of the C library to the system."""
    if sys.platform == "linux":
        trim = getattr(ctypes.CDLL(None), "malloc_trim", None)  # glibc has it
        if trim is not None:
            trim(0)


def resident() -> float:
    """Return the resident memory (bytes) of this process; infinity if it is unknown."""
    try:
        pages = int(Path("/proc/self/statm").read_text().split()[1])
    except (OSError, ValueError, IndexError):
        return float("inf")
    return float(pages * os.sysconf("SC_PAGE_SIZE"))
