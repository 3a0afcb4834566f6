"""Conversion of poses of lights and cameras: matrices in Blender; position, direction and up in
designs.

In Blender, lights and cameras look along their own -z axis, with +y up.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .numbers import kept_list, short

FloatArray = NDArray[np.float64]

SAME_DIRECTION = 3e-6
"""Distance below which unit vectors are the same: the rounding of single-precision rotations."""


def matrix_of(position: ArrayLike, direction: ArrayLike, up: ArrayLike | None) -> FloatArray:
    """Return the matrix (4, 4) of an object at `position`, (3,) mm, that looks along `direction`.

    Args:
        direction: viewing direction, (3,), of any length but zero.
        up: approximate up direction, (3,); None takes the coordinate axis z, or y for an object
            that looks along z.
    """
    ahead = np.asarray(direction, dtype=np.float64)
    ahead = ahead / np.linalg.norm(ahead)
    upward = None if up is None else np.asarray(up, dtype=np.float64)
    if upward is None or np.linalg.norm(np.cross(ahead, upward)) < 1e-9:
        upward = np.eye(3)[2 if abs(ahead[2]) < 0.9 else 1]
    right = np.cross(ahead, upward)
    right /= np.linalg.norm(right)
    result = np.eye(4)
    result[:3, 0] = right
    result[:3, 1] = np.cross(right, ahead)
    result[:3, 2] = -ahead
    result[:3, 3] = position
    return result


def pose_of(matrix: ArrayLike, original: dict[str, Any] | None, *, up: bool) -> dict[str, Any]:
    """Return position, direction and, if needed, up of an object; unchanged numbers stay as they
    were read.

    Args:
        matrix: world matrix of the object, (4, 4).
        original: pose as it was read from the design file, or None.
        up: whether the result must contain `up`, even if the original does not.

    Raises:
        ValueError: the object is scaled to zero, or its matrix is not finite.
    """
    world = np.asarray(matrix, dtype=np.float64)
    lengths = np.linalg.norm(world[:3, :3], axis=0)
    if not (np.isfinite(world).all() and (lengths > 0.0).all()):
        raise ValueError("is scaled to nothing, or nowhere; give it a place, and a scale of 1")
    axes = world[:3, :3] / lengths
    before = original or {}
    result: dict[str, Any] = {
        "position": kept_list(before.get("position"), world[:3, 3].tolist()),
    }
    was = None
    if "direction" in before:
        was = matrix_of((0, 0, 0), before["direction"], before.get("up"))[:3, :3]
    if was is not None and np.abs(was[:, 2] - axes[:, 2]).max() < SAME_DIRECTION:
        result["direction"] = before["direction"]
        if np.abs(was - axes).max() < SAME_DIRECTION:
            if before.get("up") is not None:
                result["up"] = before["up"]
            elif up:
                result["up"] = unit(axes[:, 1])
            return result
    else:
        result["direction"] = unit(-axes[:, 2])
    result["up"] = unit(axes[:, 1])
    return result


def unit(vector: ArrayLike) -> list[float]:
    """Return a direction rounded to six decimals, without negative zeros."""
    return [short(round(float(x), 6)) + 0.0 for x in np.asarray(vector)]
