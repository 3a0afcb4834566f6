"""Intersections of straight rays with meshes, without an acceleration structure."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from optisense.array_types import FloatArray, IntArray
from optisense.geometry.mesh import TriangleMesh

_PAIRS_AT_ONCE = 1_000_000
"""Number of pairs of ray and face that are tested together, which bounds the memory of the arrays
to some 50 MB."""
_NEAR = 1e-9
"""Margin of the test whether a ray passes a face's bounding sphere, as a share of the square of the
largest coordinate: far above the rounding of double precision (1e-16)."""

GLUE = 0.05
"""Largest distance (mm) between the faces of a gel and of another layer of it or a part that holds
it: the thickness of a film of glue, and more than the difference of two meshes of one curved
surface."""

NEAREST = 1e-3
"""Distance (mm) behind the skin below which a face counts as the skin itself: half of the distance
below which faces touch."""

GRAZING = 1e-6
"""Cosine between a line and the normal of a face up to which the face is parallel to the line, as
the side of a gel below a point of its border: far above the rounding of double precision."""


class RayHits(NamedTuple):
    """The intersections of rays with a mesh, sorted by ray and then by distance.

    Attributes:
        ray: (k,) int64, the ray's number.
        distance: (k,) float64, in lengths of the ray's direction.
        face: (k,) int64, the face of the mesh.
    """

    ray: NDArray[np.int64]
    distance: NDArray[np.float64]
    face: NDArray[np.int64]


def ray_hits(mesh: TriangleMesh, origins: ArrayLike, directions: ArrayLike) -> RayHits:
    """Return every intersection, from either side, of rays with a mesh.

    Pairs of rays and faces are first tested with the faces' bounding spheres. Those that remain are
    tested by the method of Woop, Benthin and Wald, "Watertight ray/triangle intersection", J.
    Computer Graphics Techniques 2 (2013). A ray through an edge or a corner that faces share meets
    at least one of them, and all of them if it meets the edge exactly.

    Args:
        mesh: any mesh, mm.
        origins: (r, 3) origins, or one (3,) for all rays, mm; one takes half the time of many.
        directions: (r, 3) directions of any length except zero, or one (3,) for all rays.
    """
    start = np.asarray(origins, dtype=np.float64).reshape(-1, 3)
    way = np.asarray(directions, dtype=np.float64).reshape(-1, 3)
    (count,) = np.broadcast_shapes(start.shape[:1], way.shape[:1])
    way = np.broadcast_to(way, (count, 3))
    corners = mesh.triangles
    middle, reach = mesh.face_spheres
    step = max(1, _PAIRS_AT_ONCE // max(1, len(corners)))
    found = []
    for i in range(0, count, step):
        origin = start if len(start) == 1 else start[i : i + step]
        found.append(_hits(corners, origin, way[i : i + step], middle, reach, i))
    if not found:
        found = [RayHits(np.zeros(0, np.int64), np.zeros(0), np.zeros(0, np.int64))]
    ray, distance, face = (np.concatenate(parts) for parts in zip(*found, strict=True))
    order = np.lexsort([distance, ray])
    return RayHits(ray[order], distance[order], face[order])


def _hits(
    corners: NDArray[np.float64],
    start: NDArray[np.float64],
    way: NDArray[np.float64],
    middle: NDArray[np.float64],
    reach: NDArray[np.float64],
    first: int,
) -> RayHits:
    """Return the intersections of rays from (r, 3) or (1, 3) along (r, 3), numbered from `first`,
    with triangles (t, 3, 3), whose bounding spheres have centres (t, 3) and squared radii (t,).
    """
    unit = way / np.linalg.norm(way, axis=1, keepdims=True)
    along = _products(unit, middle) - np.einsum("ri,ri->r", unit, start)[:, None]
    square = np.einsum("ri,ri->r", start, start)[:, None] - 2.0 * _products(start, middle)
    square += np.einsum("ti,ti->t", middle, middle) - reach
    scale = max(np.abs(start).max(initial=0.0), np.abs(middle).max(initial=0.0))
    ray, face = np.nonzero(square - along**2 <= _NEAR * scale**2)
    start = np.broadcast_to(start, way.shape)
    # Coordinates across each ray and along the axis nearest to it; those of a corner are the same
    # in all its faces.
    axes = (np.argmax(np.abs(way), axis=1)[:, None] + np.array([1, 2, 0])) % 3
    turned = np.take_along_axis(way, axes, axis=1)
    slope = turned[:, :2] / turned[:, 2:]
    away = np.take_along_axis(corners[face] - start[ray][:, None], axes[ray][:, None], axis=2)
    height = away[:, :, 2]
    x, y = np.moveaxis(away[:, :, :2] - slope[ray][:, None] * away[:, :, 2:], 2, 0)
    # The sign of an edge is exact or 0, and opposite for the face on its other side.
    pairs = (1, 2), (2, 0), (0, 1)
    edges = np.stack([x[:, i] * y[:, j] - y[:, i] * x[:, j] for i, j in pairs], axis=1)
    area = edges.sum(axis=1)
    hit = ((edges >= 0.0).all(axis=1) | (edges <= 0.0).all(axis=1)) & (area != 0.0)
    ray, face = ray[hit], face[hit]
    distance = (edges[hit] / area[hit, None] * height[hit]).sum(axis=1) / turned[ray, 2]
    ahead = distance > 0.0
    return RayHits(ray[ahead] + first, distance[ahead], face[ahead])


def _products(one: NDArray[np.float64], other: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the inner products (r, t) of vectors (r, 3) and (t, 3)."""
    # Sums of outer products rather than `@`, whose threads cost more than they save.
    result = np.multiply.outer(one[:, 0], other[:, 0])
    for axis in (1, 2):
        result += np.multiply.outer(one[:, axis], other[:, axis])
    return result


def exits(solids: Sequence[TriangleMesh], starts: FloatArray, ways: FloatArray) -> FloatArray:
    """Return the distances (n,), mm, at which lines leave the first solid that they leave, or the
    last of those that follow it without a gap above `GLUE`; infinite if they leave none.

    Layers of a gel thus count as one body, whether their meshes touch, overlap or differ a little
    at a curved face between them. A gap within a single solid always ends it. The lines start at
    points (n, 3) of the skin, mm, along unit vectors (n, 3) into the gel; the solids are one or
    more meshes, mm, with outward face normals.
    """
    found = [_stretches(solid, starts, ways) for solid in solids]
    line, start, end = (np.concatenate(parts) for parts in zip(*found, strict=True))
    result = np.full(len(starts), np.inf)
    behind = end > NEAREST
    np.minimum.at(result, line[behind], end[behind])
    goes_on = len(solids) > 1
    while goes_on:
        further = (start <= result[line] + GLUE) & (end > result[line])
        np.maximum.at(result, line[further], end[further])
        goes_on = bool(further.any())
    return result


def _stretches(
    solid: TriangleMesh, starts: FloatArray, ways: FloatArray
) -> tuple[IntArray, FloatArray, FloatArray]:
    """Return the stretches of lines inside a solid: the numbers (k,) of their lines, and the
    distances (k,) at which they start and end, mm.

    A stretch without an entry starts at minus infinity, and one without an exit ends at infinity.
    """
    hits = ray_hits(solid, starts, ways)
    cosine = np.einsum("ki,ki->k", solid.face_normals[hits.face], ways[hits.ray])
    steep = np.abs(cosine) > GRAZING
    line, distance, leaves = hits.ray[steep], hits.distance[steep], cosine[steep] > 0.0
    same = line[1:] == line[:-1]
    before = np.where(np.append(False, same), np.append(-np.inf, distance[:-1]), -np.inf)
    kept = leaves | ~np.append(same, False)
    start = np.where(leaves, before, distance)
    end = np.where(leaves, distance, np.inf)
    return line[kept], start[kept], end[kept]
