"""Arrays handed over from numpy, in memory of their own: how numpy aligns an array would become
part of compiled kernels.
"""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray


def floats(values: NDArray[np.floating]) -> mi.Float:
    """All values, row after row."""
    held = mi.Float(np.asarray(values, dtype=np.float32).ravel()) + dr.opaque(mi.Float, 0)
    dr.eval(held)
    return held


def indices(values: NDArray[np.integer] | NDArray[np.bool_]) -> mi.UInt32:
    """All values, row after row."""
    held = mi.UInt32(np.asarray(values, dtype=np.uint32).ravel()) + dr.opaque(mi.UInt32, 0)
    dr.eval(held)
    return held
