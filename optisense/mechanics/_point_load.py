"""Displacements and stresses inside a half-space due to a force on its surface.

The solutions are Boussinesq's for a force into it and Cerruti's for one along its surface (Johnson,
Contact Mechanics, 1985, sections 3.2 and 3.6).
"""

from __future__ import annotations

import numpy as np

from optisense.array_types import FloatArray

NEAREST_SQUARE = 1e-12
"""Lower bound on squared distances (mm^2), so that results are finite at the point of the load
itself: that of a distance of 1e-6 mm."""

INTO = 2
"""Axis of a force into the half-space; those of forces along its surface are 0 and 1."""
SWAPPED = [1, 0, 2]
"""Permutation of axes that exchanges x and y and so turns a force along y into one along x."""


def displacements(offsets: FloatArray, poisson_ratio: float, axis: int = INTO) -> FloatArray:
    """Return the displacements (..., 3), mm, at positions (..., 3), mm, relative to a force of 1 N
    along an axis, for a shear modulus of 1 MPa; z points into the half-space.
    """
    if axis == 1:
        return displacements(offsets[..., SWAPPED], poisson_ratio, 0)[..., SWAPPED]
    if axis == 0:
        return _displacements_along(offsets, poisson_ratio)
    x, y, z = np.moveaxis(offsets, -1, 0)
    r = np.sqrt(np.maximum(x**2 + y**2 + z**2, NEAREST_SQUARE))
    loss = 1.0 - 2.0 * poisson_ratio
    sideways = z / r**3 - loss * _inverse_product(r, z)
    inward = z**2 / r**3 + 2.0 * (1.0 - poisson_ratio) / r
    return np.stack([x * sideways, y * sideways, inward], axis=-1) / (4.0 * np.pi)


def _displacements_along(offsets: FloatArray, poisson_ratio: float) -> FloatArray:
    """Return the displacements by a force along x; see `displacements`."""
    x, y, z = np.moveaxis(offsets, -1, 0)
    r, s = _distances(x, y, z)
    loss = 1.0 - 2.0 * poisson_ratio
    along = 1.0 / r + x**2 / r**3 + loss * (1.0 / s - x**2 / (r * s**2))
    across = x * y / r**3 - loss * x * y / (r * s**2)
    inward = x * z / r**3 + loss * x / (r * s)
    return np.stack([along, across, inward], axis=-1) / (4.0 * np.pi)


def gradients(offsets: FloatArray, poisson_ratio: float, axis: int = INTO) -> FloatArray:
    """Return the derivatives (..., 3, 3) of `displacements`: row i has those of component i by x, y
    and z. The arguments are those of `displacements`.
    """
    if axis == 1:
        found = gradients(offsets[..., SWAPPED], poisson_ratio, 0)
        return np.asarray(found[..., SWAPPED, :][..., SWAPPED])
    if axis == 0:
        return _gradients_along(offsets, poisson_ratio)
    x, y, z = np.moveaxis(offsets, -1, 0)
    common, slope, by_z, inward, along_z = _gradient_into(x, y, z, poisson_ratio)
    rows = [
        [common + x * x * slope, x * y * slope, x * by_z],
        [x * y * slope, common + y * y * slope, y * by_z],
        [x * inward, y * inward, along_z],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2) / (4.0 * np.pi)


def _gradient_into(
    x: FloatArray, y: FloatArray, z: FloatArray, nu: float
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return the functions of position in `gradients` by a force into the half-space."""
    r = np.sqrt(np.maximum(x * x + y * y + z * z, NEAREST_SQUARE))
    loss = 1.0 - 2.0 * nu
    g = _inverse_product(r, z)
    cubed = 1.0 / (r * r * r)
    fifth = 3.0 * z * cubed / (r * r)
    # g = 1 / (r (r + z)); its derivatives are -x (2 r + z) g^2 / r, the like by y, and -1 / r^3.
    common = z * cubed - loss * g
    slope = loss * (2.0 * r + z) * g * g / r - fifth
    by_z = (1.0 + loss) * cubed - z * fifth
    inward = -z * fifth - 2.0 * (1.0 - nu) * cubed
    return common, slope, by_z, inward, 2.0 * z * cubed + z * inward


def _gradients_along(offsets: FloatArray, poisson_ratio: float) -> FloatArray:
    """Return the gradients by a force along x; see `gradients`."""
    x, y, z = np.moveaxis(offsets, -1, 0)
    r, s = _distances(x, y, z)
    # The terms with the Poisson ratio are the gradient of p = x / (r + z) with its last component
    # negated. These are the second derivatives of p.
    near, far = 1.0 / (r**3 * s**2), 2.0 / (r**2 * s**3)
    both = near + far
    xx = x * (x**2 * both - 3.0 / (r * s**2))
    xy = y * (x**2 * both - 1.0 / (r * s**2))
    yy = x * (y**2 * both - 1.0 / (r * s**2))
    mixed = 1.0 / (r**3 * s) + 1.0 / (r**2 * s**2)
    xz, yz = x**2 * mixed - 1.0 / (r * s), x * y * mixed
    zz = x * (z / (r**3 * s) + 1.0 / (r**2 * s))
    rows = [[xx, xy, xz], [xy, yy, yz], [-xz, -yz, -zz]]
    result = np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
    result *= 1.0 - 2.0 * poisson_ratio
    at = np.stack([x, y, z], axis=-1)
    cubed = (r**3)[..., None]
    result[..., 0, :] -= at / cubed
    result[..., :, 0] += at / cubed
    result += (x / r**3)[..., None, None] * np.eye(3)
    result -= (3.0 * x / r**5)[..., None, None] * at[..., :, None] * at[..., None, :]
    return np.asarray(result / (4.0 * np.pi))


def tractions(
    offsets: FloatArray, normals: FloatArray, poisson_ratio: float, axis: int = INTO
) -> FloatArray:
    """Return the tractions (..., 3), MPa, on planes with normals (..., 3), by a force of 1 N along
    an axis, for any shear modulus; positions are those of `displacements`.
    """
    share = 2.0 * poisson_ratio / (1.0 - 2.0 * poisson_ratio)
    if axis != INTO:
        slopes = gradients(offsets, poisson_ratio, axis)
        dilatation = share * np.trace(slopes, axis1=-2, axis2=-1)
        strains = slopes + np.swapaxes(slopes, -1, -2)  # twice the strains
        found = np.einsum("...ij,...j->...i", strains, normals)
        return np.asarray(found + dilatation[..., None] * normals)
    # The same without the matrices, in a third of the time.
    x, y, z = np.ascontiguousarray(np.moveaxis(offsets, -1, 0))
    nx, ny, nz = np.ascontiguousarray(np.moveaxis(normals, -1, 0))
    common, slope, by_z, inward, along_z = _gradient_into(x, y, z, poisson_ratio)
    sideways = x * nx + y * ny
    shear = by_z + inward
    dilatation = share * (2.0 * common + slope * (x * x + y * y) + along_z)
    towards = 2.0 * slope * sideways + shear * nz
    level = 2.0 * common + dilatation
    found = [x * towards + level * nx, y * towards + level * ny]
    found.append(shear * sideways + (2.0 * along_z + dilatation) * nz)
    return np.stack(found, axis=-1) / (4.0 * np.pi)


def _inverse_product(r: FloatArray, z: FloatArray) -> FloatArray:
    """Return 1 / (r (r + z)), bounded above the surface on the axis of the load."""
    return 1.0 / (r * np.maximum(r + z, 0.1 * r))


def _distances(x: FloatArray, y: FloatArray, z: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return r and r + z, bounded at the load and above the surface on its axis."""
    r = np.sqrt(np.maximum(x**2 + y**2 + z**2, NEAREST_SQUARE))
    return r, np.maximum(r + z, 0.1 * r)
