"""Which normals hide in a box of colours: ranges of angles over all points in many boxes.

Each of n points asks for the extremes over all points within its own colour box. A table of pairs
would be quadratic. Points are sorted into small blocks of similar colour instead, as in a k-d tree
(Bentley, 1975): blocks outside a box are skipped, of blocks inside it only the points with extreme
angles count, and only blocks on its border are looked at point by point. The result is exact.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]

BLOCK = 64
"""Points of a block; any number gives the same result."""

SECTORS = 12
"""Extreme azimuths of a block are kept for each of so many sectors of the circle."""


def ranges_in_boxes(
    colours: ArrayLike,
    low: ArrayLike,
    high: ArrayLike,
    theta: ArrayLike,
    phi: ArrayLike,
    has_azimuth: ArrayLike,
    block: int = BLOCK,
) -> tuple[FloatArray, FloatArray]:
    """Ranges of both angles over the points in each point's colour box.

    Args:
        colours: (n, 3), of the points.
        low, high: (n, 3) the boxes' corners; each box holds its own point.
        theta: (n,) polar angles, degrees.
        phi: (n,) azimuths, degrees.
        has_azimuth: (n,) points whose azimuth counts; others have a range of 0.
        block: points of a block.

    Returns:
        (n,) and (n,) degrees: largest minus smallest polar angle, and the arc of the circle that
        holds all azimuths, from the point's own to both sides; exact up to 180, which stands for
        all wider arcs.
    """
    c = np.asarray(colours, dtype=np.float64).reshape(-1, 3)
    lower = np.asarray(low, dtype=np.float64)
    upper = np.asarray(high, dtype=np.float64)
    polar = np.asarray(theta, dtype=np.float64)
    azimuth = np.asarray(phi, dtype=np.float64) % 360.0
    counts = np.asarray(has_azimuth, dtype=bool)
    blocks = _blocks(c, block)
    least = np.array([c[rows].min(axis=0) for rows in blocks])
    most = np.array([c[rows].max(axis=0) for rows in blocks])
    extremes = [_extremes(rows, polar, azimuth, counts) for rows in blocks]

    theta_range, phi_range = np.zeros(len(c)), np.zeros(len(c))
    for rows in blocks:
        touched = (most >= lower[rows].min(axis=0)).all(axis=1)
        touched &= (least <= upper[rows].max(axis=0)).all(axis=1)
        inside = (least >= lower[rows].max(axis=0)).all(axis=1)
        inside &= (most <= upper[rows].min(axis=0)).all(axis=1)
        others = np.concatenate(
            [extremes[k] if inside[k] else blocks[k] for k in np.flatnonzero(touched)]
        )
        within = np.ones((len(rows), len(others)), dtype=bool)
        for channel in range(3):
            values = c[others, channel]
            within &= values >= lower[rows, channel, None]
            within &= values <= upper[rows, channel, None]
        tilt = polar[others]
        theta_range[rows] = np.where(within, tilt, -np.inf).max(axis=1)
        theta_range[rows] -= np.where(within, tilt, np.inf).min(axis=1)
        away = (azimuth[others] - azimuth[rows, None] + 180.0) % 360.0 - 180.0
        away = np.where(within & counts[others], away, 0.0)  # 0 is the point itself
        phi_range[rows] = away.max(axis=1) - away.min(axis=1)
    return theta_range, np.where(counts, np.minimum(phi_range, 180.0), 0.0)


def _blocks(points: FloatArray, size: int) -> list[NDArray[np.int64]]:
    """Rows of points near each other: halved along the widest axis until small enough."""
    waiting, done = [np.arange(len(points))], []
    while waiting:
        rows = waiting.pop()
        if len(rows) <= size:
            done.append(rows)
            continue
        axis = int(np.ptp(points[rows], axis=0).argmax())
        half = len(rows) // 2
        rows = rows[np.argpartition(points[rows, axis], half)]
        waiting += [rows[:half], rows[half:]]
    return done


def _extremes(
    rows: NDArray[np.int64], polar: FloatArray, azimuth: FloatArray, counts: NDArray[np.bool_]
) -> NDArray[np.int64]:
    """The rows that can set a range: extreme polar angles, and extreme azimuths of each sector.

    Within a sector the extremes as seen from any azimuth outside the opposite sector are its first
    and last; from one opposite to it the arc is at least 180 either way.
    """
    ends = [rows[[polar[rows].argmin(), polar[rows].argmax()]]]
    known = rows[counts[rows]]
    if len(known):
        order = known[np.argsort(azimuth[known], kind="stable")]
        sector = (azimuth[order] * (SECTORS / 360.0)).astype(np.int64)
        change = np.flatnonzero(np.diff(sector))
        ends.append(order[np.concatenate([[0], change + 1, change, [len(order) - 1]])])
    return np.unique(np.concatenate(ends))
