"""Tilts of a surface, normals, and the angles between them.

The *tilt* of a surface at a place is the two components of its unit normal along the tangents of
the untouched surface there (the sines of the slopes). It is 0 where nothing touches, on curved
sensors too.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

STEEPEST = 80.0
"""Degrees that a read normal is tilted by at most, and between a ray and the normal of a surface
that is integrated; steeper ones count as this."""


def tilts_of(normals: NDArray[np.floating], first: FloatArray, second: FloatArray) -> FloatArray:
    """(..., 2): the components of unit normals (..., 3) along two tangents (..., 3)."""
    return np.stack(
        [np.einsum("...i,...i", normals, first), np.einsum("...i,...i", normals, second)], axis=-1
    )


def normals_of(
    tilts: FloatArray, first: FloatArray, second: FloatArray, normals: FloatArray
) -> FloatArray:
    """(..., 3): unit normals tilted so (..., 2) from the untouched ones, by STEEPEST at most."""
    most = np.sin(np.radians(STEEPEST))
    length = np.linalg.norm(tilts, axis=-1, keepdims=True)
    within = tilts * np.minimum(1.0, most / np.maximum(length, 1e-12))
    along = within[..., :1] * first + within[..., 1:] * second
    rest = np.sqrt(1.0 - (within**2).sum(axis=-1, keepdims=True))
    return along + rest * normals


def angles_between(first: FloatArray, second: FloatArray) -> FloatArray:
    """(...) degrees between unit vectors (..., 3)."""
    cosine = np.einsum("...i,...i", first, second)
    return np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))
