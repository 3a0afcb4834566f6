"""Intersections of the faces of meshes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from optisense.array_types import FloatArray
from optisense.geometry._box_pairs import BoxPairs, overlapping_boxes, overlapping_pairs
from optisense.geometry.mesh import TriangleMesh

TOUCH = 1e-4
"""Depth (mm) up to which faces that reach through one another only touch: above the rounding of
mesh files, and a twentieth of the depth from which on parts overlap."""


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
    pairs = overlapping_pairs(*mesh.face_bounds)
    return _crossings(mesh, mesh, _with_area(mesh, mesh, pairs), limit)


def crossings(first: TriangleMesh, second: TriangleMesh, limit: int | None = None) -> Crossings:
    """Find the faces of two meshes that cut through each other; coincident faces do not count. The
    search ends after `limit` crossings.
    """
    return _crossings(first, second, near_pairs(first, second), limit)


def near_pairs(first: TriangleMesh, second: TriangleMesh) -> BoxPairs:
    """Find the pairs of faces whose boxes overlap; faces without area are left out.

    The pairs come in batches, none of which is empty: numbers (k,) of faces of the first mesh and
    (k,) of the second.
    """
    pairs = overlapping_boxes(*first.face_bounds, *second.face_bounds)
    return _with_area(first, second, pairs)


def _with_area(first: TriangleMesh, second: TriangleMesh, batches: BoxPairs) -> BoxPairs:
    """Leave out pairs with a face without area."""
    for one, other in batches:
        kept = (first.face_areas[one] > 0.0) & (second.face_areas[other] > 0.0)
        if kept.any():
            yield one[kept], other[kept]


def _crossings(
    first: TriangleMesh, second: TriangleMesh, batches: BoxPairs, limit: int | None
) -> Crossings:
    """Return the pairs of faces that cross.

    Each reaches through the plane of the other, and their sections of the line in which the planes
    intersect overlap (Moeller, "A fast triangle-triangle intersection test", J. Graphics Tools 2,
    1997).
    """
    pairs, places, count = [np.zeros((0, 2), dtype=np.int64)], [np.zeros((0, 3))], 0
    for a, b in batches:
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
