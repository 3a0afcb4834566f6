"""Arrays on the device: copies of NumPy arrays, and arrays that are joined."""

from __future__ import annotations

import subprocess
import sys

import mitsuba as mi
import numpy as np

from optisense.optics.backend.arrays import joined

AT_THE_END_OF_MEMORY = """
import ctypes, mmap
import drjit as dr
import numpy as np
from optisense.optics.backend.variant import use_variant

use_variant("llvm")
from optisense.optics.backend.arrays import floats, indices

page = mmap.PAGESIZE
memory = mmap.mmap(-1, 2 * page)
second = ctypes.addressof(ctypes.c_char.from_buffer(memory)) + page
no_access = 0
assert ctypes.CDLL(None).mprotect(ctypes.c_void_p(second), page, no_access) == 0
for kind, copied in ((np.float32, floats), (np.uint32, indices)):
    values = np.frombuffer(memory, kind, count=5, offset=page - 20)
    held = copied(values)
    dr.sync_thread()
    assert np.asarray(held).tolist() == [0, 0, 0, 0, 0]
print("read")
"""
"""Copies arrays of five entries at the end of a page, behind which memory must not be read."""


def test_nothing_behind_an_array_is_read() -> None:
    done = subprocess.run(
        [sys.executable, "-c", AT_THE_END_OF_MEMORY], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout == "read\n"


def test_arrays_of_vectors_and_of_tuples_are_joined() -> None:
    one = mi.Point3f(mi.Float([1, 2]), mi.Float([3, 4]), mi.Float([5, 6]))
    other = mi.Point3f(mi.Float([7]), mi.Float([8]), mi.Float([9]))
    points, numbers = joined((one, mi.UInt32([1, 2])), (other, mi.UInt32([3])))
    assert np.array(points).tolist() == [[1, 2, 7], [3, 4, 8], [5, 6, 9]]
    assert np.array(numbers).tolist() == [1, 2, 3]
