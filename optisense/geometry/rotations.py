"""Rotation matrices."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from optisense.array_types import FloatArray


def rotation(axis: ArrayLike, degrees: float) -> FloatArray:
    """Return the matrix (3, 3) of the right-handed rotation about an axis (3,), by Rodrigues'
    formula.

    Quarter turns are exact, so that flat faces stay in the planes of the axes.
    """
    cosine, sine = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    if degrees % 90.0 == 0.0:
        cosine, sine = np.round(cosine), np.round(sine)
    given = np.asarray(axis, dtype=np.float64)
    x, y, z = given / np.linalg.norm(given)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + sine * cross + (1.0 - cosine) * cross @ cross)


def turn_about_axes(x: float, y: float = 0.0, z: float = 0.0) -> FloatArray:
    """Return the matrix (3, 3) of rotations, in degrees, about x, then y, then z of a fixed
    frame.
    """
    about_x, about_y, about_z = map(rotation, np.eye(3), (x, y, z))
    return about_z @ about_y @ about_x
