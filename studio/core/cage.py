"""Cages: a lattice of control points that bends what lies in its box, quickly enough to drag.

The same free-form deformation as in `optisense.geometry.cage` (Sederberg and Parry, 1986): sums
of Bernstein polynomials. The weights depend on the vertices at rest only and are made once.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]
Resolution = tuple[int, int, int]

OUTSIDE_TOLERANCE = 1e-6
"""Distance that a vertex may lie outside the box, mm: rounding, no more."""


def rest_points(box: ArrayLike, resolution: Resolution) -> FloatArray:
    """Return the control points at rest, (nx * ny * nz, 3) mm; x varies slowest, z fastest."""
    lower, upper = np.asarray(box, dtype=np.float64)
    axes = [np.linspace(lower[k], upper[k], resolution[k]) for k in range(3)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


def weights(vertices: ArrayLike, box: ArrayLike, resolution: Resolution) -> FloatArray:
    """Return the weight of each control point for each vertex, (n, nx * ny * nz).

    Raises:
        ValueError: a vertex lies outside the box.
    """
    points = np.asarray(vertices, dtype=np.float64).reshape(-1, 3)
    lower, upper = np.asarray(box, dtype=np.float64)
    if ((points < lower - OUTSIDE_TOLERANCE) | (points > upper + OUTSIDE_TOLERANCE)).any():
        raise ValueError("part of the mesh lies outside the box of its cage")
    along = ((points - lower) / (upper - lower)).clip(0.0, 1.0)
    bases = [_bernstein(along[:, k], resolution[k]) for k in range(3)]
    product = np.einsum("ni,nj,nk->nijk", *bases, optimize=True)
    return product.reshape(len(points), -1)


def edges(resolution: Resolution) -> NDArray[np.int32]:
    """Return the pairs of neighbouring control points, (m, 2), that the lattice's lines join."""
    index = np.arange(math.prod(resolution)).reshape(resolution)
    pairs = [
        np.stack([index.take(range(n - 1), axis), index.take(range(1, n), axis)], -1).reshape(-1, 2)
        for axis, n in enumerate(resolution)
    ]
    return np.concatenate(pairs).astype(np.int32)


def blended(c_min: ArrayLike, c_max: ArrayLike, blend: ArrayLike) -> FloatArray:
    """Return (1 - A) C_min + A C_max, (N, 3) mm, with one A or one for each coordinate."""
    share = np.asarray(blend, dtype=np.float64)
    return (1.0 - share) * np.asarray(c_min) + share * np.asarray(c_max)


def nearest_blend(points: ArrayLike, c_min: ArrayLike, c_max: ArrayLike) -> float:
    """Return the blend A in 0..1 whose shape (1 - A) C_min + A C_max is nearest, by least squares.

    Args:
        points: shape to approximate, (N, 3) mm.
        c_min: shape of A = 0, (N, 3) mm.
        c_max: shape of A = 1, (N, 3) mm; the blend is 0 if it equals `c_min`.
    """
    lower = np.asarray(c_min, dtype=np.float64)
    way = (np.asarray(c_max, dtype=np.float64) - lower).ravel()
    length = float(way @ way)
    if length == 0.0:
        return 0.0
    along = float((np.asarray(points, dtype=np.float64) - lower).ravel() @ way)
    return min(max(along / length, 0.0), 1.0)


def _bernstein(t: FloatArray, count: int) -> FloatArray:
    i = np.arange(count)
    binomial = np.array([math.comb(count - 1, k) for k in range(count)], dtype=np.float64)
    return binomial * t[:, None] ** i * (1.0 - t[:, None]) ** (count - 1 - i)
