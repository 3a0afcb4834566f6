"""Intersections of the faces of meshes, and of boxes around them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from optisense.array_types import FloatArray, IntArray
from optisense.geometry.mesh import TriangleMesh

TOUCH = 1e-4
"""Depth (mm) up to which faces that reach through one another only touch: above the rounding of
mesh files, and a twentieth of the depth from which on parts overlap."""

_PAIRS_AT_ONCE = 500_000
"""Number of pairs of faces that are intersected together, which bounds the memory of the arrays to
some 100 MB."""

ROUNDS = 4
"""Number of rounds in which two sets of boxes are reduced to those in the box around the other set;
further rounds remove few."""


class Crossings(NamedTuple):
    """Pairs of faces that cut through one another.

    Attributes:
        pairs: (k, 2) int64, numbers of a face of the first and one of the second mesh.
        places: (k, 3) float64, a common point of both, mm.
    """

    pairs: NDArray[np.int64]
    places: FloatArray


def self_crossings(mesh: TriangleMesh, limit: int | None = None) -> Crossings:
    """Find the faces of a welded mesh that cut through each other; neighbours that only meet do not
    count. The search ends after `limit` crossings.
    """
    one, other = overlapping_pairs(*mesh.face_bounds)
    solid = (mesh.face_areas[one] > 0.0) & (mesh.face_areas[other] > 0.0)
    return _crossings(mesh, mesh, one[solid], other[solid], limit)


def crossings(first: TriangleMesh, second: TriangleMesh, limit: int | None = None) -> Crossings:
    """Find the faces of two meshes that cut through each other; coincident faces do not count. The
    search ends after `limit` crossings.
    """
    return _crossings(first, second, *near_pairs(first, second), limit)


def near_pairs(
    first: TriangleMesh, second: TriangleMesh
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the pairs of faces whose boxes overlap: the number (k,) of a face of the first mesh
    and (k,) of the second. Faces without area are left out.
    """
    one, other = overlapping_boxes(*first.face_bounds, *second.face_bounds)
    solid = (first.face_areas[one] > 0.0) & (second.face_areas[other] > 0.0)
    return one[solid], other[solid]


def _crossings(
    first: TriangleMesh,
    second: TriangleMesh,
    one: NDArray[np.int64],
    other: NDArray[np.int64],
    limit: int | None,
) -> Crossings:
    """Return the pairs of faces that cross.

    Each reaches through the plane of the other, and their sections of the line in which the planes
    intersect overlap (Moeller, "A fast triangle-triangle intersection test", J. Graphics Tools 2,
    1997).
    """
    pairs, places, count = [np.zeros((0, 2), dtype=np.int64)], [np.zeros((0, 3))], 0
    for start in range(0, len(one), _PAIRS_AT_ONCE):
        a, b = one[start : start + _PAIRS_AT_ONCE], other[start : start + _PAIRS_AT_ONCE]
        heights_a = heights(first, a, second, b)
        through = _reach_through(heights_a)
        a, b, heights_a = a[through], b[through], heights_a[through]
        heights_b = heights(second, b, first, a)
        through = _reach_through(heights_b)
        a, b, heights_a, heights_b = a[through], b[through], heights_a[through], heights_b[through]
        line = np.cross(first.face_normals[a], second.face_normals[b])
        line /= np.linalg.norm(line, axis=1, keepdims=True)
        from_a, to_a, at_a = _cut_out(first.triangles[a], heights_a, line)
        from_b, to_b, _ = _cut_out(second.triangles[b], heights_b, line)
        low, high = np.maximum(from_a, from_b), np.minimum(to_a, to_b)
        found = high - low > TOUCH
        middle = at_a + (0.5 * (low + high) - np.einsum("ki,ki->k", at_a, line))[:, None] * line
        pairs.append(np.column_stack([a[found], b[found]]))
        places.append(middle[found])
        count += int(found.sum())
        if limit is not None and count >= limit:
            break
    return Crossings(np.concatenate(pairs)[:limit], np.concatenate(places)[:limit])


def heights(
    of: TriangleMesh, faces: NDArray[np.int64], planes: TriangleMesh, against: NDArray[np.int64]
) -> FloatArray:
    """Return the heights (k, 3), mm, of the corners of faces above the planes of others."""
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
    """Return triangles' sections by a plane: start and end along the line (mm), a point of it."""
    rows = np.arange(len(triangles))
    # Both edges of the corner that is alone on its side of the plane pass through the plane.
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


def overlapping_boxes(
    low_1: FloatArray, high_1: FloatArray, low_2: FloatArray, high_2: FloatArray
) -> tuple[IntArray, IntArray]:
    """Return the pairs of boxes of two sets that overlap or touch, in no particular order.

    Boxes that lie outside of the one around the other set are left out first. Then a tree of
    rectangles finds the pairs that overlap when seen along the axis over which the boxes
    extend least, and few of these lie behind one another. The corners are (n, 3) and (k, 3), and
    the results the numbers (p,) in the first set and (p,) in the second.
    """
    from shapely import STRtree, box

    boxes = [(low_1, high_1), (low_2, high_2)]
    rows = [np.arange(len(low_1)), np.arange(len(low_2))]
    for turn in range(2 * ROUNDS):
        if not all(map(len, rows)):
            break
        this, other = turn % 2, 1 - turn % 2
        (low, high), (other_low, other_high) = boxes[this], boxes[other]
        near = ((low <= other_high.max(axis=0)) & (high >= other_low.min(axis=0))).all(axis=1)
        if not near.all():
            rows[this], boxes[this] = rows[this][near], (low[near], high[near])
        elif turn > 0:  # neither set would become smaller any more
            break
    if not all(map(len, rows)):
        return rows[0][:0], rows[1][:0]
    (low_1, high_1), (low_2, high_2) = boxes
    extent = np.maximum(high_1.max(axis=0), high_2.max(axis=0)) - np.minimum(
        low_1.min(axis=0), low_2.min(axis=0)
    )
    along, *across = np.argsort(extent)
    tree = STRtree(box(*low_2[:, across].T, *high_2[:, across].T))
    one, two = tree.query(box(*low_1[:, across].T, *high_1[:, across].T))
    meet = (low_1[one, along] <= high_2[two, along]) & (high_1[one, along] >= low_2[two, along])
    return rows[0][one[meet]], rows[1][two[meet]]


def overlapping_pairs(low: FloatArray, high: FloatArray) -> tuple[IntArray, IntArray]:
    """Return the pairs of boxes with corners (n, 3) that overlap or touch, each pair once: the
    smaller (p,) and the larger number (p,) of each.
    """
    one, other = overlapping_boxes(low, high, low, high)
    ordered = one < other
    return one[ordered], other[ordered]
