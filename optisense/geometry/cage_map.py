"""The deformation of space by a cage: its stretch, its folds, and refinement of the cage."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from optisense.array_types import FloatArray
from optisense.geometry.cage import Resolution, bernstein, box_coordinates, contract

MOST_COMBINATIONS = 100_000
"""Largest number of combinations of differences that are tested, which take some milliseconds; with
more, the result is unknown, and slower tests decide."""


def jacobians(
    vertices: ArrayLike, box: ArrayLike, resolution: Resolution, points: ArrayLike
) -> FloatArray:
    """Return the Jacobian matrix of the deformation at each vertex.

    Args:
        vertices: (n, 3) vertices at rest, mm, inside the box.
        box, resolution, points: the cage; see `deformed`.

    Returns:
        The derivatives (n, 3, 3) of deformed coordinates (row) by coordinates at rest (column). The
        determinant is the local change of volume; it is negative where space is turned inside out.

    Raises:
        DesignError: a vertex lies outside the box.
    """
    share = box_coordinates(vertices, box)
    result = np.empty((len(share), 3, 3))
    for axis, slopes in enumerate(_slopes(box, resolution, points)):
        nx, ny, nz = slopes.shape[:3]
        bases = [bernstein(share[:, k], slopes.shape[k]) for k in range(3)]
        result[:, :, axis] = contract(bases, slopes.reshape(-1, 3), (nx, ny, nz))
    return result


def _slopes(box: ArrayLike, resolution: Resolution, points: ArrayLike) -> list[FloatArray]:
    """Return the differences of control points along x, y and z, over their distances at rest.

    The derivative of a Bernstein sum is the sum of one degree less over these differences.
    """
    size = np.diff(np.asarray(box, dtype=np.float64), axis=0)[0]
    lattice = np.asarray(points, dtype=np.float64).reshape(*resolution, 3)
    return [np.diff(lattice, axis=k) * (resolution[k] - 1) / size[k] for k in range(3)]


def is_one_to_one(box: ArrayLike, resolution: Resolution, points: ArrayLike) -> bool:
    """Return whether the map of the box by the cage is certainly one to one.

    The condition is sufficient and holds for bends of ordinary size: if the symmetric part of the
    derivative is positive definite everywhere in a convex box, the map is one to one (the
    difference of two images has a positive component along the difference of the points). Each
    column of the derivative is a mean of the differences of control points along its axis, and
    positive definite matrices form a convex set, so that only combinations of these differences
    need to be tested. They are taken relative to the mean derivative, so that a rotation of the
    whole lattice has no effect. False means that it is unknown.
    """
    columns = [slopes.reshape(-1, 3) for slopes in _slopes(box, resolution, points)]
    mean = np.column_stack([column.mean(axis=0) for column in columns])
    if not np.isfinite(mean).all() or np.linalg.det(mean) <= 0.0:
        return False
    inverse = np.linalg.inv(mean)
    columns = [np.unique(np.round(column @ inverse.T, 9), axis=0) for column in columns]
    if math.prod(len(column) for column in columns) > MOST_COMBINATIONS:
        return False
    a = columns[0][:, None, None]
    b = columns[1][None, :, None]
    c = columns[2][None, None, :]
    xx, yy, zz = a[..., 0], b[..., 1], c[..., 2]
    xy, xz, yz = (
        0.5 * (a[..., 1] + b[..., 0]),
        0.5 * (a[..., 2] + c[..., 0]),
        0.5 * (b[..., 2] + c[..., 1]),
    )
    minor = xx * yy - xy * xy  # Sylvester: all leading minors above 0
    whole = minor * zz - xx * yz * yz - yy * xz * xz + 2.0 * xy * xz * yz
    return bool((xx > 0.0).all() and (minor > 0.0).all() and (whole > 0.0).all())


def refined_points(points: ArrayLike, resolution: Resolution, finer: Resolution) -> FloatArray:
    """Return control points of a finer lattice with exactly the same deformation.

    The method is degree elevation of Bernstein polynomials (Farin, "Curves and Surfaces for CAGD",
    section on degree elevation), axis by axis, one point at a time.

    Args:
        points: (nx * ny * nz, 3) control points, mm.
        resolution: nx, ny, nz.
        finer: resolution of the finer lattice, at least as many points along each axis.

    Returns:
        The control points (fx * fy * fz, 3) float64, mm.
    """
    lattice = np.asarray(points, dtype=np.float64).reshape(*resolution, 3)
    for axis in range(3):
        lattice = np.moveaxis(lattice, axis, 0)
        while len(lattice) < finer[axis]:
            count = len(lattice)
            before = (np.arange(count + 1) / count).reshape(-1, 1, 1, 1)
            zero = np.zeros_like(lattice[:1])
            lattice = before * np.concatenate([zero, lattice]) + (1.0 - before) * np.concatenate(
                [lattice, zero]
            )
        lattice = np.moveaxis(lattice, 0, axis)
    return lattice.reshape(-1, 3)
