"""Limits on the freed memory that Dr.Jit keeps for further arrays."""

from __future__ import annotations

import ctypes
import gc
import os
import sys
from pathlib import Path

import drjit as dr

MOST_RESIDENT = 2 * 2**30
"""Resident memory (bytes) of this process above which Dr.Jit's freed memory is returned to the
system. Tracing the light of a built-in sensor takes up to 1.5 GB, of which less than 0.4 GB are in
use afterwards."""


def bound_memory() -> None:
    """Return memory that Dr.Jit has freed to the system if the process exceeds `MOST_RESIDENT`.

    Dr.Jit keeps the memory of freed arrays for new ones of the same size. As designs need different
    sizes, the memory of models made in turn would grow without bound.
    """
    if resident() > MOST_RESIDENT:
        dr.flush_malloc_cache()


def release_memory() -> None:
    """Return all unused memory to the system, including freed pages of the C library.

    It is meant for work that continues with another sensor: after GelSight360 and then a Mini, 0.3
    GB of 1.1 GB stay in use.
    """
    gc.collect()
    dr.sync_thread()
    dr.flush_malloc_cache()
    if sys.platform == "linux":
        trim = getattr(ctypes.CDLL(None), "malloc_trim", None)  # glibc has it
        if trim is not None:
            trim(0)


def resident() -> float:
    """Return the resident memory (bytes) of this process; infinity if the system does not report
    it.
    """
    try:
        pages = int(Path("/proc/self/statm").read_text().split()[1])
    except (OSError, ValueError, IndexError):
        return float("inf")
    return float(pages * os.sysconf("SC_PAGE_SIZE"))
