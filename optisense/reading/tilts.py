"""Tilts of a surface, normals, and the angles between them.

The *tilt* of a surface at a place is the two components of its unit normal along the tangents of
the untouched surface there (the sines of the slopes; see `SensingSurface.tangents`). It is 0 where
nothing touches, also on curved sensors.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from optisense.array_types import FloatArray

STEEPEST = 80.0
"""Largest tilt (degrees) of a read normal, and largest angle between a ray and the normal of an
integrated surface; larger angles are reduced to it."""


def tilts_of(normals: NDArray[np.floating], first: FloatArray, second: FloatArray) -> FloatArray:
    """Return the components (..., 2) of unit normals (..., 3) along two tangents (..., 3)."""
    return np.stack(
        [np.einsum("...i,...i", normals, first), np.einsum("...i,...i", normals, second)], axis=-1
    )


def normals_of(
    tilts: FloatArray, first: FloatArray, second: FloatArray, normals: FloatArray
) -> FloatArray:
    """Return unit normals (..., 3) at tilts (..., 2) from untouched ones, by at most STEEPEST."""
    most = np.sin(np.radians(STEEPEST))
    length = np.linalg.norm(tilts, axis=-1, keepdims=True)
    within = tilts * np.minimum(1.0, most / np.maximum(length, 1e-12))
    along = within[..., :1] * first + within[..., 1:] * second
    rest = np.sqrt(1.0 - (within**2).sum(axis=-1, keepdims=True))
    return along + rest * normals


def angles_between(first: FloatArray, second: FloatArray) -> FloatArray:
    """Return the angles (...), degrees, between unit vectors (..., 3)."""
    cosine = np.einsum("...i,...i", first, second)
    return np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))
