"""Triangles and polygons in a plane, pair by pair."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from optisense.array_types import FloatArray

THINNEST = 1e-4
"""Thickness (mm) below which the remainder of a face counts as rounding: a thousand cells of the
grid to which cut polygons are rounded (`geometry.coincidence._GRID`), and a twentieth of the
distance below which faces touch (`design.arrangement.COINCIDENCE_TOLERANCE`)."""


def common(triangles: FloatArray, others: FloatArray) -> FloatArray:
    """Return the corners (k, 6, 2) of the intersections of triangles (k, 3, 2), pair by pair; the
    first corner is repeated where there are fewer than six.

    Each edge of the other triangle cuts off what lies beyond it (Sutherland and Hodgman, "Reentrant
    polygon clipping", Comm. ACM 17, 1974).
    """
    corners = triangles
    for across, offset in zip(*(lines.swapaxes(0, 1) for lines in _edges(others)), strict=True):
        depth = np.einsum("kci,ki->kc", corners, across) - offset[:, None]
        following = np.roll(depth, -1, axis=1)
        crosses = (depth >= 0.0) != (following >= 0.0)
        part = depth / np.where(crosses, depth - following, 1.0)
        crossing = corners + part[..., None] * (np.roll(corners, -1, axis=1) - corners)
        size = corners.shape[1]
        found = np.stack([corners, crossing], axis=2).reshape(-1, 2 * size, 2)
        kept = np.stack([depth >= 0.0, crosses], axis=2).reshape(-1, 2 * size)
        order = np.argsort(~kept, axis=1, kind="stable")[:, : size + 1]
        found = np.take_along_axis(found, order[..., None], axis=1)
        kept = np.take_along_axis(kept, order, axis=1)
        corners = np.where(kept[..., None], found, found[:, :1])
    return corners


def contains(triangles: FloatArray, points: FloatArray, tolerance: float) -> NDArray[np.bool_]:
    """Return a mask (k,) of triangles (k, 3, 2), of either winding, that contain their points."""
    inside: NDArray[np.bool_] = np.all(_inward(triangles, points) >= -tolerance, axis=(1, 2))
    return inside


def lie_apart(triangles: FloatArray, points: FloatArray) -> NDArray[np.bool_]:
    """Return a mask (k,) of triangles (k, 3, 2) with an edge beyond which all their points lie."""
    beyond = _inward(triangles, points) <= THINNEST
    apart: NDArray[np.bool_] = np.any(np.all(beyond, axis=2), axis=1)
    return apart


def heights_over(points: FloatArray, triangles: FloatArray) -> FloatArray:
    """Return the height (k, c), over points (k, c, 2), of triangles' planes (k, 3, 3)."""
    a = triangles[:, 0]
    normal = np.cross(triangles[:, 1] - a, triangles[:, 2] - a)
    slope = -normal[:, :2] / np.where(normal[:, 2:] == 0.0, 1e-300, normal[:, 2:])
    heights: FloatArray = a[:, None, 2] + np.einsum("ki,kci->kc", slope, points - a[:, None, :2])
    return heights


def area_and_length(corners: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the areas (k,) and perimeters (k,) of convex polygons (k, c, 2)."""
    steps = np.roll(corners, -1, axis=1) - corners
    area: FloatArray = 0.5 * np.abs(_cross(corners - corners[:, :1], steps).sum(axis=1))
    return area, np.linalg.norm(steps, axis=2).sum(axis=1)


def is_shape(area: FloatArray, length: FloatArray) -> NDArray[np.bool_]:
    """Return a mask of the polygons of given areas and perimeters that are larger than rounding."""
    shape: NDArray[np.bool_] = 2.0 * area > THINNEST * length
    return shape


def interpolated(values: FloatArray, corners: FloatArray, points: FloatArray) -> FloatArray:
    """Interpolate unit vectors at points (n, 2), each in a triangle with `values` (n, 3, 3) at its
    `corners` (n, 3, 2).
    """
    edges = (corners[:, 1:] - corners[:, :1]).swapaxes(1, 2)
    bary = np.linalg.solve(edges, (points - corners[:, 0])[:, :, None])
    mixed = values[:, 0] + ((values[:, 1:] - values[:, :1]) * bary).sum(axis=1)
    unit: FloatArray = mixed / np.linalg.norm(mixed, axis=1, keepdims=True)
    return unit


def _inward(triangles: FloatArray, points: FloatArray) -> FloatArray:
    """Return the distance (k, 3, c) of points (k, c, 2) from each edge line, positive inside."""
    across, offset = _edges(triangles)
    result: FloatArray = across @ points.transpose(0, 2, 1) - offset[:, :, None]
    return result


def _edges(triangles: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the inward unit normals (k, 3, 2) of the edges of triangles of either winding, and the
    distances (k, 3) of the edges along them from the origin.
    """
    edges = np.roll(triangles, -1, axis=1) - triangles
    length = np.maximum(np.linalg.norm(edges, axis=2), 1e-300)
    turn = np.sign(_cross(edges[:, 0], edges[:, 1]))
    across = np.stack([-edges[..., 1], edges[..., 0]], axis=2) * (turn[:, None] / length)[..., None]
    return across, np.einsum("kei,kei->ke", across, triangles)


def _cross(one: FloatArray, other: FloatArray) -> FloatArray:
    """Return the cross product (...) of vectors (..., 2)."""
    turn: FloatArray = one[..., 0] * other[..., 1] - one[..., 1] * other[..., 0]
    return turn
