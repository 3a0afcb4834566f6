"""Tests whether points are inside a closed mesh."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from optisense.array_types import FloatArray
from optisense.geometry.mesh import TriangleMesh

RAY_DIRECTION = np.array([0.3578, 0.2113, 0.9096])
"""Direction of the test rays, nearly a unit vector: not parallel to an axis or a diagonal, so that
they meet few edges of symmetric meshes."""

NEAR_EDGE = 1e-9
"""Distance of a ray from an edge, as a share of the face's size, below which its result is not
used: far above the rounding of double precision (1e-16)."""

BLOCK = 36
"""Number of points, one after another, that are tested together, after the faces near all of them
are selected: neighbouring facets, and points at which the window of a light is tested, lie close
together."""


def inside(points: ArrayLike, mesh: TriangleMesh) -> NDArray[np.bool_]:
    """Return a mask (n,) of the points (n, 3), mm, inside a closed mesh of either winding.

    The test counts the crossings of a ray from the point with the mesh; if the ray passes too close
    to an edge, the solid angle of the whole mesh is used.
    """
    places = np.asarray(points, dtype=np.float64).reshape(-1, 3)
    result = np.zeros(len(places), dtype=bool)
    low, high = mesh.bounds
    near = np.flatnonzero(((places > low) & (places < high)).all(axis=1))
    if len(near) == 0:
        return result
    frame = _frame()
    turned = frame @ mesh.vertices.T
    a, b, c = (turned[:, mesh.faces[:, corner]] for corner in range(3))
    lowest = np.minimum(np.minimum(a, b), c)
    highest = np.maximum(np.maximum(a, b), c)
    seen = places[near] @ frame.T
    for first in range(0, len(near), BLOCK):
        block = seen[first : first + BLOCK]
        beside = np.flatnonzero(_beside(lowest, highest, block.min(axis=0), block.max(axis=0)))
        low, high = lowest[:, None, beside], highest[:, None, beside]
        owner, met = np.nonzero(_beside(low, high, block.T[..., None], block.T[..., None]))
        face = beside[met]
        corners = np.stack([a[:, face].T, b[:, face].T, c[:, face].T], axis=1)
        turns, unsure = _crossings(corners - block[owner, None], owner, len(block))
        for number in np.flatnonzero(unsure):
            turns[number] = _turns(mesh, places[near[first + number]])
        result[near[first : first + BLOCK]] = turns != 0
    return result


def _beside(
    lowest: FloatArray, highest: FloatArray, low: FloatArray, high: FloatArray
) -> NDArray[np.bool_]:
    """Return a mask (m,) or (n, m) of the faces, with bounds (3, m) or (3, 1, m), that rays along
    +z from a box with bounds (3,), or from points (3, n, 1), may meet.
    """
    beside: NDArray[np.bool_] = (lowest[0] <= high[0]) & (highest[0] >= low[0])
    beside &= (lowest[1] <= high[1]) & (highest[1] >= low[1])
    beside &= highest[2] >= low[2]
    return beside


def _frame() -> FloatArray:
    """Return the axes (3, 3) as rows: two perpendicular to the rays, and the rays' direction."""
    way = RAY_DIRECTION / np.linalg.norm(RAY_DIRECTION)
    across = np.cross(way, (1.0, 0.0, 0.0))
    across /= np.linalg.norm(across)
    return np.array([across, np.cross(way, across), way])


def _crossings(
    corners: FloatArray, owner: NDArray[np.integer], count: int
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Return the exits minus entries (count,) of rays along +z, and whether they are uncertain, for
    corners (m, 3, 3) of faces relative to the origin of the ray, `owner` (m,), that may meet them.
    """
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    edges = np.stack([_cross(b, c), _cross(c, a), _cross(a, b)], axis=1)
    area = edges.sum(axis=1)
    size = np.ptp(corners[:, :, :2], axis=1).max(axis=1) ** 2
    with np.errstate(divide="ignore", invalid="ignore"):
        share = edges / area[:, None]
    unsure = (np.abs(edges) <= NEAR_EDGE * size[:, None]).any(axis=1)
    # Edges that are far from the ray's line do not make the result uncertain.
    unsure &= (edges >= -NEAR_EDGE * size[:, None]).all(axis=1) | (
        edges <= NEAR_EDGE * size[:, None]
    ).all(axis=1)
    hit = (edges > 0.0).all(axis=1) | (edges < 0.0).all(axis=1)
    height = np.einsum("mi,mi->m", share[hit], corners[hit][:, :, 2])
    signs = np.sign(area[hit]) * (height > 0.0)
    turns = np.bincount(owner[hit], signs, count).astype(np.int64)
    return turns, np.bincount(owner[unsure], minlength=count) > 0


def _cross(one: FloatArray, other: FloatArray) -> FloatArray:
    return one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0]


def _turns(mesh: TriangleMesh, point: FloatArray) -> int:
    """Return the winding number of a mesh around a point from its solid angle (Van Oosterom and
    Strackee, "The solid angle of a plane triangle", IEEE Trans. Biomed. Eng. 30, 1983).
    """
    corners = mesh.triangles - point
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    la, lb, lc = (np.linalg.norm(corner, axis=1) for corner in (a, b, c))
    determinant = np.einsum("ij,ij->i", a, np.cross(b, c))
    divisor = la * lb * lc + np.einsum("ij,ij->i", a, b) * lc
    divisor += np.einsum("ij,ij->i", b, c) * la + np.einsum("ij,ij->i", c, a) * lb
    solid_angle = 2.0 * np.arctan2(determinant, divisor).sum()
    return round(float(solid_angle) / (4.0 * np.pi))
