"""Device arrays copied from NumPy arrays.

The copies lie in memory of their own, because the alignment of a NumPy array would become part of
compiled kernels, which could then not be used again.
"""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray


def floats(values: NDArray[np.floating]) -> mi.Float:
    """All values of an array, row after row."""
    held = mi.Float(np.asarray(values, dtype=np.float32).ravel()) + dr.opaque(mi.Float, 0)
    dr.eval(held)
    return held


def indices(values: NDArray[np.integer] | NDArray[np.bool_]) -> mi.UInt32:
    """All values of an array, row after row."""
    held = mi.UInt32(np.asarray(values, dtype=np.uint32).ravel()) + dr.opaque(mi.UInt32, 0)
    dr.eval(held)
    return held
