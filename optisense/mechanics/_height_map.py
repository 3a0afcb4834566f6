"""Heights of meshes over a plane, on a regular grid."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from optisense.array_types import FloatArray
from optisense.geometry import TriangleMesh

LEAST_UPRIGHT = 0.05
"""Smallest z of unit shading normals with which the heights of a triangle are curved. Steeper
triangles (87 degrees and more) are flat, as their tangent planes have no reliable height."""
PIXELS_AT_ONCE = 4_000_000
"""Number of pairs of a triangle and a grid point that are processed at once, about 200 MB."""

SLACK = 1e-6
"""Distance from an edge, as a share of its height and of the pitch, within which grid points are
tested for whether they lie on a triangle: far above the rounding of double precision."""


def heights(mesh: TriangleMesh, x: FloatArray, y: FloatArray, highest: bool = False) -> FloatArray:
    """Return the lowest (or highest) z (rows, columns), mm, of a mesh at each point of a regular
    grid with ascending coordinates x (columns,) and y (rows,); infinity (minus infinity for the
    highest) where there is no triangle.

    If the mesh has shading normals, heights follow a quadratic surface through each triangle:
    half-way from the triangle to the tangent planes of its corners, weighted by barycentric
    coordinates. This is exact for paraboloids, and continuous across edges.
    """
    sign = -1.0 if highest else 1.0
    result = np.full(len(x) * len(y), np.inf)
    corners = mesh.triangles
    pitch_x, pitch_y = x[1] - x[0], y[1] - y[0]
    low, high = mesh.face_bounds
    first_x = np.ceil((low[:, 0] - x[0]) / pitch_x - 1e-9).clip(0, len(x)).astype(np.int64)
    last_x = np.floor((high[:, 0] - x[0]) / pitch_x + 1e-9).clip(-1, len(x) - 1).astype(np.int64)
    first_y = np.ceil((low[:, 1] - y[0]) / pitch_y - 1e-9).clip(0, len(y)).astype(np.int64)
    last_y = np.floor((high[:, 1] - y[0]) / pitch_y + 1e-9).clip(-1, len(y) - 1).astype(np.int64)
    wide = np.maximum(last_x - first_x + 1, 0)
    count = wide * np.maximum(last_y - first_y + 1, 0)
    edges = corners[:, 1:, :2] - corners[:, :1, :2]
    area = edges[:, 0, 0] * edges[:, 1, 1] - edges[:, 0, 1] * edges[:, 1, 0]
    kept = np.flatnonzero((count > 0) & (np.abs(area) > 0.0))
    running = np.cumsum(count[kept])
    begin = 0
    while begin < len(kept):
        done = running[begin - 1] if begin else 0
        end = max(begin + 1, int(np.searchsorted(running, done + PIXELS_AT_ONCE, side="right")))
        some = kept[begin:end]
        face, row, column = _points_on(corners, some, first_y, last_y, x, y)
        away_x, away_y = x[column] - corners[face, 0, 0], y[row] - corners[face, 0, 1]
        e, f = edges[face, 0], edges[face, 1]
        second = (away_x * f[:, 1] - away_y * f[:, 0]) / area[face]
        third = (away_y * e[:, 0] - away_x * e[:, 1]) / area[face]
        inside = (second >= -1e-9) & (third >= -1e-9) & (second + third <= 1.0 + 1e-9)
        face, row, column = face[inside], row[inside], column[inside]
        shares = second[inside], third[inside]
        z = _on_triangles(mesh, corners, face, shares, x[column], y[row])
        np.minimum.at(result, row * len(x) + column, sign * z)
        begin = end
    return sign * result.reshape(len(y), len(x))


def _points_on(
    corners: FloatArray,
    some: NDArray[np.int64],
    first_row: NDArray[np.int64],
    last_row: NDArray[np.int64],
    x: FloatArray,
    y: FloatArray,
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Return the triangle, the row and the column of all pairs of one of ``some`` triangles and a
    grid point on it, or slightly beside it.

    Each triangle with corners (faces, 3, 3) lies between two rows (faces,) of the grid.
    """
    face, number = _counted(some, last_row[some] - first_row[some] + 1)
    row = first_row[face] + number
    low, high = np.full(len(face), np.inf), np.full(len(face), -np.inf)
    for k in range(3):
        (ax, ay), (bx, by) = corners[face, k, :2].T, corners[face, (k + 1) % 3, :2].T
        rise = by - ay
        share = np.divide(y[row] - ay, rise, out=np.full_like(rise, np.inf), where=rise != 0.0)
        met = (share >= -SLACK) & (share <= 1.0 + SLACK)
        at = ax + np.where(met, share, 0.0) * (bx - ax)
        low = np.where(met, np.minimum(low, at), low)
        high = np.where(met, np.maximum(high, at), high)
    pitch = x[1] - x[0]
    met = np.isfinite(low)
    face, row = face[met], row[met]
    first = np.ceil((low[met] - x[0]) / pitch - SLACK).clip(0, len(x)).astype(np.int64)
    last = np.floor((high[met] - x[0]) / pitch + SLACK).clip(-1, len(x) - 1).astype(np.int64)
    pair, number = _counted(np.arange(len(face)), np.maximum(last - first + 1, 0))
    return face[pair], row[pair], first[pair] + number


def _counted(
    values: NDArray[np.int64], counts: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return each value as often as its count says, and the number of each repetition from 0 on."""
    starts = np.cumsum(counts) - counts
    return np.repeat(values, counts), np.arange(int(counts.sum())) - np.repeat(starts, counts)


def slopes(height: FloatArray, pitch: float, apart: int = 1) -> tuple[FloatArray, FloatArray]:
    """Return the slopes of heights (rows, columns), mm, NaN where there is none, by x and by y.

    They are the mean of the slopes to the points on both sides, at a pitch (mm) of some steps of
    the grid, the slope to the only one with a height, or NaN where there is none.
    """
    found = []
    for along in (height.T, height):
        step = along[apart:] - along[:-apart]
        both = [np.pad(step, (ends, (0, 0)), constant_values=np.nan)
                for ends in ((apart, 0), (0, apart))]  # fmt: skip
        known = np.isfinite(both).sum(axis=0)
        total = np.nan_to_num(both).sum(axis=0)
        found.append(np.where(known > 0, total / np.maximum(known, 1), np.nan) / pitch)
    return found[0].T, found[1]


def _on_triangles(
    mesh: TriangleMesh,
    corners: FloatArray,
    face: NDArray[np.int64],
    shares: tuple[FloatArray, FloatArray],
    x: FloatArray,
    y: FloatArray,
) -> FloatArray:
    """Return the heights (n,), mm, of points on faces by barycentric coordinates of corners."""
    second, third = shares
    all_three = 1.0 - second - third, second, third
    flat = sum(share * corners[face, k, 2] for k, share in enumerate(all_three))
    if mesh.normals is None:
        return np.asarray(flat)
    normals = mesh.normals[mesh.faces]
    upright = np.abs(normals[:, :, 2]) > LEAST_UPRIGHT
    curved = np.all(upright, axis=1)[face]
    divisor = np.where(upright, normals[:, :, 2], 1.0)
    slopes = -normals[:, :, :2] / divisor[:, :, None]
    rise = sum(
        share
        * (
            slopes[face, k, 0] * (x - corners[face, k, 0])
            + slopes[face, k, 1] * (y - corners[face, k, 1])
        )
        for k, share in enumerate(all_three)
    )
    return np.asarray(flat + np.where(curved, 0.5 * rise, 0.0))
