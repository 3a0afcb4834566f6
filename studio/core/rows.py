"""Rows of lights on a face."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


def row_on_face(
    corners: FloatArray, normal: FloatArray, target: FloatArray, count: int, pitch: float
) -> list[dict[str, Any]]:
    """Poses of lights in a row through the middle of a face, along its longer side.

    Args:
        corners: (n, 3) mm, vertices of the face.
        normal: (3,) of the face, of any length but zero.
        target: (3,) mm; the lights shine along the normal, to the side where this is.
        count: how many lights.
        pitch: mm between neighbours.
    """
    way = normal / np.linalg.norm(normal)
    middle = (corners.min(axis=0) + corners.max(axis=0)) / 2
    if way @ (target - middle) < 0.0:
        way = -way
    flat = (corners - middle) - np.outer((corners - middle) @ way, way)
    _, _, axes = np.linalg.svd(flat, full_matrices=False)
    along = axes[0] - (axes[0] @ way) * way
    along /= np.linalg.norm(along)
    along *= np.sign(along[np.argmax(np.abs(along))])
    up = np.cross(way, along)
    shifts = (np.arange(count) - (count - 1) / 2) * pitch
    return [
        {
            "position": [round(float(x), 6) + 0.0 for x in middle + shift * along],
            "direction": [round(float(x), 6) + 0.0 for x in way],
            "up": [round(float(x), 6) + 0.0 for x in up],
        }
        for shift in shifts
    ]
