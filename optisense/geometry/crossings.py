"""Where the faces of meshes cut through one another."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from optisense.geometry.mesh import FloatArray, TriangleMesh

TOUCH = 1e-4
"""mm: faces that reach through one another by less only touch."""

_PAIRS_AT_ONCE = 500_000
_BLOCK = 64
"""Faces that are looked at together first."""

_DENSE = 1_000_000
"""Up to so many pairs of boxes are compared one by one; a tree takes longer to build."""


class Crossings(NamedTuple):
    """Pairs of faces that cut through one another.

    Attributes:
        pairs: (k, 2) int64, a face of the first and one of the second mesh.
        places: (k, 3) float64, mm, a point that both have in common.
    """

    pairs: NDArray[np.int64]
    places: FloatArray


def self_crossings(mesh: TriangleMesh, limit: int | None = None) -> Crossings:
    """Faces of one mesh that cut through each other; welded neighbours that only meet do not.

    Args:
        mesh: a mesh whose neighbours share vertices (see `TriangleMesh.welded`).
        limit: stop looking once this many are found; None finds all.
    """
    one, other = near_pairs(mesh, mesh)
    once = one < other
    return _crossings(mesh, mesh, one[once], other[once], limit)


def crossings(first: TriangleMesh, second: TriangleMesh, limit: int | None = None) -> Crossings:
    """Faces of two meshes that cut through each other; faces that lie on one another do not.

    Args:
        limit: stop looking once this many are found; None finds all.
    """
    return _crossings(first, second, *near_pairs(first, second), limit)


def near_pairs(
    first: TriangleMesh, second: TriangleMesh
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Pairs of faces whose boxes meet; faces without area are left out."""
    low_1, high_1 = first.face_bounds
    low_2, high_2 = second.face_bounds
    blocks_1, blocks_2 = _block_boxes(low_1, high_1), _block_boxes(low_2, high_2)
    near = _meeting(*blocks_1, *blocks_2)
    near_1, near_2 = np.flatnonzero(near.any(axis=1)), np.flatnonzero(near.any(axis=0))
    kept_1 = _faces_of(near_1, low_1, high_1, blocks_2, near_2)
    kept_2 = _faces_of(near_2, low_2, high_2, blocks_1, near_1)
    kept_1 = kept_1[first.face_areas[kept_1] > 0.0]
    kept_2 = kept_2[second.face_areas[kept_2] > 0.0]
    if len(kept_1) == 0 or len(kept_2) == 0:
        return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)
    if len(kept_1) * len(kept_2) <= _DENSE:
        meet = _meeting(low_1[kept_1], high_1[kept_1], low_2[kept_2], high_2[kept_2])
        one, other = np.nonzero(meet)
        return kept_1[one], kept_2[other]
    third, x, y = np.argsort(np.ptp(first.bounds, axis=0))
    tree = shapely.STRtree(
        shapely.box(low_2[kept_2, x], low_2[kept_2, y], high_2[kept_2, x], high_2[kept_2, y])
    )
    boxes = shapely.box(low_1[kept_1, x], low_1[kept_1, y], high_1[kept_1, x], high_1[kept_1, y])
    one, other = tree.query(boxes)
    one, other = kept_1[one], kept_2[other]
    meets = (low_1[one, third] <= high_2[other, third]) & (
        high_1[one, third] >= low_2[other, third]
    )
    return one[meets].astype(np.int64), other[meets].astype(np.int64)


def _block_boxes(low: FloatArray, high: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The boxes of blocks of faces; those that follow one another mostly lie together."""
    starts = np.arange(0, len(low), _BLOCK)
    return np.minimum.reduceat(low, starts), np.maximum.reduceat(high, starts)


def _meeting(
    low_1: FloatArray, high_1: FloatArray, low_2: FloatArray, high_2: FloatArray
) -> NDArray[np.bool_]:
    """(n, k): which of n boxes meet which of k others."""
    meet = np.ones((len(low_1), len(low_2)), dtype=bool)
    for axis in range(3):
        meet &= low_1[:, None, axis] <= high_2[:, axis]
        meet &= high_1[:, None, axis] >= low_2[:, axis]
    return meet


def _faces_of(
    near: NDArray[np.intp],
    low: FloatArray,
    high: FloatArray,
    others: tuple[FloatArray, FloatArray],
    near_others: NDArray[np.intp],
) -> NDArray[np.int64]:
    """The faces of the blocks `near` that meet the box around the other mesh's near blocks."""
    faces = (near[:, None] * _BLOCK + np.arange(_BLOCK)).ravel().astype(np.int64)
    faces = faces[faces < len(low)]
    if len(faces) == 0:
        return faces
    other_low, other_high = others[0][near_others], others[1][near_others]
    meets = (low[faces] <= other_high.max(axis=0)) & (high[faces] >= other_low.min(axis=0))
    return faces[meets.all(axis=1)]


def _crossings(
    first: TriangleMesh,
    second: TriangleMesh,
    one: NDArray[np.int64],
    other: NDArray[np.int64],
    limit: int | None,
) -> Crossings:
    """Which of the pairs cross.

    Each reaches through the plane of the other, and what they cut out of the line in which the
    planes meet overlaps (Moeller, "A fast triangle-triangle intersection test", J. Graphics
    Tools 2, 1997).
    """
    pairs, places, count = [np.zeros((0, 2), dtype=np.int64)], [np.zeros((0, 3))], 0
    for start in range(0, len(one), _PAIRS_AT_ONCE):
        a, b = one[start : start + _PAIRS_AT_ONCE], other[start : start + _PAIRS_AT_ONCE]
        heights_a, heights_b = _heights(first, a, second, b), _heights(second, b, first, a)
        through = _reach_through(heights_a) & _reach_through(heights_b)
        a, b = a[through], b[through]
        line = np.cross(first.face_normals[a], second.face_normals[b])
        line /= np.linalg.norm(line, axis=1, keepdims=True)
        from_a, to_a, at_a = _cut_out(first.triangles[a], heights_a[through], line)
        from_b, to_b, _ = _cut_out(second.triangles[b], heights_b[through], line)
        low, high = np.maximum(from_a, from_b), np.minimum(to_a, to_b)
        found = high - low > TOUCH
        middle = at_a + (0.5 * (low + high) - np.einsum("ki,ki->k", at_a, line))[:, None] * line
        pairs.append(np.column_stack([a[found], b[found]]))
        places.append(middle[found])
        count += int(found.sum())
        if limit is not None and count >= limit:
            break
    return Crossings(np.concatenate(pairs)[:limit], np.concatenate(places)[:limit])


def _heights(
    of: TriangleMesh, faces: NDArray[np.int64], planes: TriangleMesh, against: NDArray[np.int64]
) -> FloatArray:
    """(k, 3) mm: how far the corners of faces lie above the planes of others."""
    origin = planes.triangles[against, :1]
    heights: FloatArray = np.einsum(
        "kci,ki->kc", of.triangles[faces] - origin, planes.face_normals[against]
    )
    return heights


def _reach_through(heights: FloatArray) -> NDArray[np.bool_]:
    result: NDArray[np.bool_] = (heights.min(axis=1) < -TOUCH) & (heights.max(axis=1) > TOUCH)
    return result


def _cut_out(
    triangles: FloatArray, heights: FloatArray, line: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """What a plane cuts out of triangles: from and to along the line (mm), and a point of it."""
    rows = np.arange(len(triangles))
    # The corner that is alone on its side of the plane: both its edges go through.
    above = heights > 0.0
    alone = np.where(above.sum(axis=1) == 1, above.argmax(axis=1), (~above).argmax(axis=1))
    apex, height = triangles[rows, alone], heights[rows, alone]
    ends = []
    for step in (1, 2):
        corner = (alone + step) % 3
        share = height / (height - heights[rows, corner])
        ends.append(apex + share[:, None] * (triangles[rows, corner] - apex))
    along = np.stack([np.einsum("ki,ki->k", end, line) for end in ends], axis=1)
    return along.min(axis=1), along.max(axis=1), ends[0]
