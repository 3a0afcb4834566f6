"""The cage: a lattice of control points that deforms whatever lies in its box.

Free-form deformation with a tensor product of Bernstein polynomials (Sederberg and Parry,
"Free-form deformation of solid geometric models", SIGGRAPH 1986). A lattice of n points along an
axis gives polynomials of degree n - 1: the shape is smooth everywhere, the corner points are
interpolated, and the lattice at rest leaves every point where it is (linear precision). A point
in the middle of a side moves the surface by less than its own way: of three points in a row, the
middle one has weight 1/2 over itself.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from optisense.errors import DesignError

FloatArray = NDArray[np.float64]

OUTSIDE_TOLERANCE = 1e-6
"""A vertex may lie this far (mm) outside of the box: rounding in a mesh file."""


def cage_points(box: ArrayLike, resolution: tuple[int, int, int]) -> FloatArray:
    """The control points of a cage at rest.

    Args:
        box: (2, 3) mm, lower and upper corner.
        resolution: number of points along x, y, z, at least 2 each.

    Returns:
        (nx * ny * nz, 3) float64, mm; x slowest, z fastest.
    """
    lower, upper = np.asarray(box, dtype=np.float64)
    axes = [np.linspace(lower[k], upper[k], resolution[k]) for k in range(3)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


def cage_weights(
    vertices: ArrayLike, box: ArrayLike, resolution: tuple[int, int, int]
) -> FloatArray:
    """How much each control point moves each vertex.

    Args:
        vertices: (n, 3) mm, undeformed; all inside the box.
        box: (2, 3) mm, lower and upper corner.
        resolution: number of points along x, y, z, at least 2 each.

    Returns:
        (n, nx * ny * nz) float64; each row adds up to 1.

    Raises:
        DesignError: a vertex lies outside the box, where the polynomials would run away.
    """
    points = np.asarray(vertices, dtype=np.float64).reshape(-1, 3)
    lower, upper = np.asarray(box, dtype=np.float64)
    outside = (points < lower - OUTSIDE_TOLERANCE) | (points > upper + OUTSIDE_TOLERANCE)
    if outside.any():
        rows = np.flatnonzero(outside.any(axis=1))
        x, y, z = points[rows[0]]
        raise DesignError(
            f"{len(rows)} vertices lie outside the box of the cage, "
            f"one of them at ({x:.3f}, {y:.3f}, {z:.3f}) mm",
            where="box from ({:.3f}, {:.3f}, {:.3f}) to ({:.3f}, {:.3f}, {:.3f}) mm".format(
                *lower, *upper
            ),
            hint="let the box enclose every part that the cage deforms",
        )
    share = ((points - lower) / (upper - lower)).clip(0.0, 1.0)
    along = [_bernstein(share[:, k], resolution[k]) for k in range(3)]
    product = np.einsum("ni,nj,nk->nijk", *along, optimize=True)
    return product.reshape(len(points), -1)


def deform(weights: FloatArray, points: ArrayLike) -> FloatArray:
    """The deformed vertices (n, 3) mm for `weights` (n, N) and control points (N, 3) mm."""
    moved: FloatArray = weights @ np.asarray(points, dtype=np.float64).reshape(-1, 3)
    return moved


def _bernstein(t: FloatArray, count: int) -> FloatArray:
    """The `count` Bernstein polynomials of degree `count` - 1 at t (n,): (n, count)."""
    i = np.arange(count)
    degree = count - 1
    binomial = np.array([math.comb(degree, k) for k in range(count)], dtype=np.float64)
    return binomial * t[:, None] ** i * (1.0 - t[:, None]) ** (degree - i)
