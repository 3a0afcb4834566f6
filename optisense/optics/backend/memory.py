"""Memory that Dr.Jit keeps for the next arrays, and how much of it may stay."""

from __future__ import annotations

import ctypes
import gc
import os
import sys
from pathlib import Path

import drjit as dr

MOST_RESIDENT = 2 * 2**30
"""Bytes that this process may take up before Dr.Jit's freed memory is given back. The light of a
built-in sensor takes up to 1.5 GB to trace, of which less than 0.4 GB are in use afterwards."""


def bound_memory() -> None:
    """Give memory that Dr.Jit has freed and keeps back to the system, where it has become much.

    Dr.Jit keeps the memory of arrays for others of the same size. Designs need different sizes, so
    that models made in turn would take up more and more.
    """
    if resident() > MOST_RESIDENT:
        dr.flush_malloc_cache()


def release_memory() -> None:
    """Give back to the system whatever nothing uses any more, freed pages of the C library too.

    It is for work that goes on to another sensor: after GelSight360 and then a Mini, 0.3 GB of 1.1
    GB stay.
    """
    gc.collect()
    dr.sync_thread()
    dr.flush_malloc_cache()
    if sys.platform == "linux":
        trim = getattr(ctypes.CDLL(None), "malloc_trim", None)  # glibc has it
        if trim is not None:
            trim(0)


def resident() -> float:
    """Bytes of memory that this process takes up; infinity where the system does not report it."""
    try:
        pages = int(Path("/proc/self/statm").read_text().split()[1])
    except (OSError, ValueError, IndexError):
        return float("inf")
    return float(pages * os.sysconf("SC_PAGE_SIZE"))
