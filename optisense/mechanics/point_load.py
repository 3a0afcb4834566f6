"""A force on the surface of a half-space: displacements and stresses inside it.

The solution is Boussinesq's (Johnson, Contact Mechanics, 1985, section 3.2).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

NEAREST_SQUARE = 1e-12
"""mm^2; squared distances are kept above it, so that the point of the load itself gives numbers."""


def displacements(offsets: FloatArray, poisson_ratio: float) -> FloatArray:
    """(..., 3) mm by a force of 1 N along z, for a shear modulus of 1 MPa.

    Args:
        offsets: (..., 3) mm from the load; z points into the half-space.
        poisson_ratio: of the half-space.
    """
    x, y, z = np.moveaxis(offsets, -1, 0)
    r = np.sqrt(np.maximum(x**2 + y**2 + z**2, NEAREST_SQUARE))
    loss = 1.0 - 2.0 * poisson_ratio
    sideways = z / r**3 - loss * _inverse_product(r, z)
    inward = z**2 / r**3 + 2.0 * (1.0 - poisson_ratio) / r
    return np.stack([x * sideways, y * sideways, inward], axis=-1) / (4.0 * np.pi)


def gradients(offsets: FloatArray, poisson_ratio: float) -> FloatArray:
    """(..., 3, 3) derivatives of `displacements`: row i has those of component i by x, y and z."""
    x, y, z = np.moveaxis(offsets, -1, 0)
    r = np.sqrt(np.maximum(x**2 + y**2 + z**2, NEAREST_SQUARE))
    nu = poisson_ratio
    loss = 1.0 - 2.0 * nu
    g = _inverse_product(r, z)
    # g = 1 / (r (r + z)); its derivatives are -x (2 r + z) g^2 / r, the like by y, and -1 / r^3.
    common = z / r**3 - loss * g
    slope = -3.0 * z / r**5 + loss * (2.0 * r + z) * g**2 / r
    by_z = 1.0 / r**3 - 3.0 * z**2 / r**5 + loss / r**3
    rows = [
        [common + x * x * slope, x * y * slope, x * by_z],
        [x * y * slope, common + y * y * slope, y * by_z],
    ]
    inward = -3.0 * z**2 / r**5 - 2.0 * (1.0 - nu) / r**3
    rows.append([x * inward, y * inward, 2.0 * z / r**3 + z * inward])
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2) / (4.0 * np.pi)


def stresses(offsets: FloatArray, poisson_ratio: float) -> FloatArray:
    """(..., 3, 3) MPa of a force of 1 N along z; they do not depend on the shear modulus."""
    slopes = gradients(offsets, poisson_ratio)
    strains = slopes + np.swapaxes(slopes, -1, -2)  # twice
    dilatation = np.trace(slopes, axis1=-2, axis2=-1)
    share = 2.0 * poisson_ratio / (1.0 - 2.0 * poisson_ratio)
    return np.asarray(strains + share * dilatation[..., None, None] * np.eye(3))


def _inverse_product(r: FloatArray, z: FloatArray) -> FloatArray:
    """1 / (r (r + z)), bounded above the surface, on the axis of the load."""
    return 1.0 / (r * np.maximum(r + z, 0.1 * r))
