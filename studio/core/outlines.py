"""Lines and triangles with which a sensor is drawn, as arrays."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

CREASE = 30.0
"""Smallest angle in degrees between two faces for which their common edge is drawn; those of a
cylinder of 13 sides or more are not.
"""

BEAM_STEPS = 24
"""Number of sides of a cone-shaped beam; it looks round."""


FAR_APART = 8.0
"""Ratio of a quad's side to the median side above which its corners are taken not to be neighbours
on the surface; a view at a slant stretches quads less than that.
"""


def feature_edges(
    corners: ArrayLike, starts: ArrayLike, normals: ArrayLike, edges: int
) -> NDArray[np.int64]:
    """Return the indices of the edges of a mesh that are creases or borders.

    Args:
        corners: index of the edge at each corner of the faces, (m,), one face after the other.
        starts: index in `corners` of the first corner of each face, (n,).
        normals: normals of the faces, (n, 3).

    Returns:
        Indices (k,) of the edges whose faces meet at more than `CREASE`, or that have one face
        only.
    """
    at, begins = np.asarray(corners), np.asarray(starts)
    faces = np.searchsorted(begins, np.arange(len(at)), side="right") - 1
    count = np.bincount(at, minlength=edges)
    order = np.argsort(at, kind="stable")
    first = np.concatenate([[0], np.cumsum(count)[:-1]])
    shared = np.flatnonzero(count == 2)
    one, other = faces[order[first[shared]]], faces[order[first[shared] + 1]]
    way = np.asarray(normals, dtype=np.float64)
    bent = (way[one] * way[other]).sum(axis=1) < math.cos(math.radians(CREASE))
    return np.sort(np.concatenate([shared[bent], np.flatnonzero((count == 1) | (count > 2))]))


def face_normals(triangles: ArrayLike) -> NDArray[np.float64]:
    """Return unit normals of triangles (m, 3, 3), (m, 3); zero for one without area."""
    one, two, three = np.moveaxis(np.asarray(triangles), 1, 0)
    found = np.cross(two - one, three - one)
    return found / np.maximum(np.linalg.norm(found, axis=1, keepdims=True), 1e-12)


def beam(
    shape: str, size: tuple[float, float], half_angle: float, length: float
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return the sides of a lamp's beam along -z, and the brightness at their corners.

    Args:
        shape: shape of the lamp's window, `disc` or `rectangle`.
        size: width and height of the window, mm.
        half_angle: angle by which the beam widens, degrees.
        length: length of the beam, mm.

    Returns:
        Corners of triangles, (3 n, 3) mm, and their brightness, (3 n,): 1 at the window, 0 at the
        end.
    """
    width, height = size[0] / 2, size[1] / 2
    if shape == "rectangle":
        rim = np.array([(-width, -height), (width, -height), (width, height), (-width, height)])
    else:
        turns = np.linspace(0.0, math.tau, BEAM_STEPS, endpoint=False)
        rim = np.stack([width * np.cos(turns), width * np.sin(turns)], axis=1)
    wider = length * math.tan(math.radians(half_angle))
    reach = np.linalg.norm(rim, axis=1, keepdims=True)
    end = rim * (1.0 + wider / np.maximum(reach, 1e-9))
    near = np.column_stack([rim, np.zeros(len(rim))])
    far = np.column_stack([end, np.full(len(rim), -length)])
    after = np.roll(np.arange(len(rim)), -1)
    corners = np.stack([near, near[after], far, far, near[after], far[after]], axis=1)
    left = np.tile([1.0, 1.0, 0.0, 0.0, 1.0, 0.0], len(rim))
    return corners.reshape(-1, 3).astype(np.float32), left.astype(np.float32)


def window(shape: str, size: tuple[float, float]) -> NDArray[np.float32]:
    """Return the corners of triangles that fill a lamp's window, (3 n, 3) mm."""
    corners, _ = beam(shape, size, 0.0, 1.0)
    rim = corners.reshape(-1, 6, 3)[:, :2]
    middle = np.zeros((len(rim), 1, 3), dtype=np.float32)
    return np.concatenate([rim, middle], axis=1).reshape(-1, 3)


def grid_quads(
    points: NDArray[np.float32], hit: NDArray[np.bool_]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the quads between neighbouring points of a grid, and the outline of all quads
    together.

    Args:
        points: points at which rays met a surface, (h, w, 3).
        hit: whether each ray met the surface, (h, w).

    Returns:
        Corners of the quads in their order around, (n, 4) indices, without quads between points
        that lie far apart, such as on either side of a mirror's edge; and the ends of the edges
        that belong to one quad only, (m, 2) indices.
    """
    height, width = hit.shape
    number = np.arange(height * width).reshape(height, width)
    corners = np.stack(
        [number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]], axis=-1
    ).reshape(-1, 4)
    corners = corners[hit.ravel()[corners].all(axis=1)]
    if not len(corners):
        return corners, np.empty((0, 2), dtype=np.int64)
    flat = points.reshape(-1, 3)
    sides = np.linalg.norm(flat[corners] - flat[np.roll(corners, -1, axis=1)], axis=2)
    corners = corners[sides.max(axis=1) < FAR_APART * np.median(sides)]
    edges = np.stack([corners, np.roll(corners, -1, axis=1)], axis=-1).reshape(-1, 2)
    edges.sort(axis=1)
    found, count = np.unique(edges, axis=0, return_counts=True)
    return corners, found[count == 1]
