"""Nine places that cover a sensing surface evenly."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from optisense.array_types import FloatArray
from optisense.errors import ContactError

_ROUNDS = 200
"""Largest number of rounds of the clustering, which usually converges much sooner."""
_STILL = 1e-4
"""Movement of the places in one round, relative to the size of the surface, below which the
clustering has converged."""
_AS_NEAR = 1.02
"""Ratio of squared distances from a place below which two points count as equally near: the middle
of a symmetric view lies between four pixels. Among such points of the built-in sensors, the ratio
is at most 1.002; the next one is 1.057."""


def nine_places(points: ArrayLike, weights: ArrayLike | None = None) -> NDArray[np.int64]:
    """Choose nine of many surface points so that each stands for an equal, compact patch.

    The method is weighted k-means (Lloyd, "Least squares quantization in PCM", 1982), started from
    a three by three grid along the principal axes of the points. It is deterministic. Of points
    that are equally near to the middle of a patch, it chooses the first, so that rounding, which
    differs between processors and GPUs, does not decide.

    Args:
        points: (n, 3) points of the visible sensing surface, mm; at least nine. Those that
            are not finite are left out.
        weights: (n,) the area that each point stands for; equal if None.

    Returns:
        (9,) int64 rows of `points`, row by row along the start grid.

    Raises:
        ContactError: fewer than nine points that are finite.
    """
    where = np.asarray(points, dtype=np.float64).reshape(-1, 3)
    share = np.ones(len(where)) if weights is None else np.asarray(weights, dtype=np.float64)
    seen = np.flatnonzero((share > 0.0) & np.isfinite(where).all(axis=1))
    if len(seen) < 9:
        raise ContactError(
            f"only {len(seen)} points of the sensing surface are visible, nine are needed",
            hint="Check that the camera sees the sensing surface",
        )
    where, share = where[seen], share[seen]
    where = where - np.average(where, axis=0, weights=share)
    nearest = _three_by_three(where, share)
    centres = np.zeros((9, 3))
    for _ in range(_ROUNDS):
        before = centres
        centres = _middles(where, share, nearest, before)
        nearest = np.argmin(_distances(where, centres), axis=1)
        if np.abs(centres - before).max() < _STILL * np.abs(where).max():
            break
    squares = np.maximum(_distances(where, centres), 0.0)
    return seen[np.argmax(squares <= _AS_NEAR * squares.min(axis=0), axis=0)]


def _middles(
    points: FloatArray, share: FloatArray, patch: NDArray[np.int64], before: FloatArray
) -> FloatArray:
    """Return the weighted centre (9, 3) of each patch; an empty patch keeps its place."""
    mass = np.bincount(patch, share, 9)[:, None]
    total = np.stack([np.bincount(patch, share * column, 9) for column in points.T], axis=1)
    return np.where(mass > 0.0, total / np.maximum(mass, 1e-300), before)


def _distances(points: FloatArray, centres: FloatArray) -> FloatArray:
    """Return the squared distances (n, 9), mm^2."""
    squares = (points**2).sum(axis=1)[:, None] + (centres**2).sum(axis=1)
    distances: FloatArray = squares - 2.0 * points @ centres.T
    return distances


def _three_by_three(points: FloatArray, share: FloatArray) -> NDArray[np.int64]:
    """Return the patch numbers 0 to 8 of points: three strips of equal area, each divided into
    three parts of equal area.
    """
    _, axes = np.linalg.eigh(np.cov(points.T, aweights=share))
    main = axes[:, :0:-1]  # the two axes along which the points spread most
    main = main * np.sign(main[np.abs(main).argmax(axis=0), [0, 1]])
    flat = points @ main
    patch = np.zeros(len(points), dtype=np.int64)
    strip = _thirds(flat[:, 0], share)
    for row in range(3):
        inside = np.flatnonzero(strip == row)
        patch[inside] = 3 * row + _thirds(flat[inside, 1], share[inside])
    return patch


def _thirds(values: FloatArray, share: FloatArray) -> NDArray[np.int64]:
    """Return 0, 1 or 2 for each value: the third of the total share that it falls in."""
    order = np.argsort(values, kind="stable")
    below = np.cumsum(share[order]) - 0.5 * share[order]
    result = np.empty(len(values), dtype=np.int64)
    result[order] = np.minimum(3.0 * below / max(float(share.sum()), 1e-300), 2.0).astype(np.int64)
    return result
