"""Nine places that cover a sensing surface evenly."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from optisense.errors import ContactError

_ROUNDS = 100


def nine_places(points: ArrayLike, weights: ArrayLike | None = None) -> NDArray[np.int64]:
    """Choose nine of many surface points so that each stands for an equal, compact patch.

    Weighted k-means (Lloyd, "Least squares quantization in PCM", 1982) from a three by three
    start along the main axes of the points; without chance, so the same points give the same
    places.

    Args:
        points: (n, 3) mm, points of the visible sensing surface; at least nine.
        weights: (n,) the area that each point stands for; equal if None.

    Returns:
        (9,) int64 rows of `points`, row by row along the start grid.

    Raises:
        ContactError: fewer than nine points.
    """
    where = np.asarray(points, dtype=np.float64).reshape(-1, 3)
    share = np.ones(len(where)) if weights is None else np.asarray(weights, dtype=np.float64)
    seen = np.flatnonzero(share > 0.0)
    if len(seen) < 9:
        raise ContactError(
            f"only {len(seen)} points of the sensing surface are visible, nine are needed",
            hint="check that the camera sees the sensing surface",
        )
    where, share = where[seen], share[seen]
    nearest = _three_by_three(where, share)
    centres = np.zeros((9, 3))
    for _ in range(_ROUNDS):
        mass = np.bincount(nearest, share, 9)
        for axis in range(3):
            total = np.bincount(nearest, share * where[:, axis], 9)
            centres[:, axis] = np.where(
                mass > 0, total / np.maximum(mass, 1e-300), centres[:, axis]
            )
        distance = np.linalg.norm(where[:, None] - centres, axis=2)
        before, nearest = nearest, np.argmin(distance, axis=1)
        if (before == nearest).all():
            break
    return seen[np.argmin(distance, axis=0)]


def _three_by_three(points: NDArray[np.float64], share: NDArray[np.float64]) -> NDArray[np.int64]:
    """Patch numbers 0..8: three strips of equal area, each in three parts of equal area."""
    centred = points - np.average(points, axis=0, weights=share)
    _, axes = np.linalg.eigh(np.cov(centred.T, aweights=share))
    main = axes[:, :0:-1]  # the two axes along which the points spread most
    main = main * np.sign(main[np.abs(main).argmax(axis=0), [0, 1]])
    flat = centred @ main
    patch = np.zeros(len(points), dtype=np.int64)
    strip = _thirds(flat[:, 0], share)
    for row in range(3):
        inside = np.flatnonzero(strip == row)
        patch[inside] = 3 * row + _thirds(flat[inside, 1], share[inside])
    return patch


def _thirds(values: NDArray[np.float64], share: NDArray[np.float64]) -> NDArray[np.int64]:
    """0, 1 or 2: the third of the total share that each value falls in."""
    order = np.argsort(values, kind="stable")
    below = np.cumsum(share[order]) - 0.5 * share[order]
    result = np.empty(len(values), dtype=np.int64)
    result[order] = np.minimum(3.0 * below / max(float(share.sum()), 1e-300), 2.0).astype(np.int64)
    return result
