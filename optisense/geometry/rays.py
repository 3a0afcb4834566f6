"""Intersections of straight rays with a mesh, without an acceleration structure."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from optisense.geometry.mesh import TriangleMesh

_PAIRS_AT_ONCE = 1_000_000
"""Number of pairs of ray and face that are tested together, which bounds the memory of the arrays
to some 50 MB."""
_NEAR = 1e-9
"""Margin of the test whether a ray passes a face's bounding sphere, as a share of the square of the
largest coordinate: far above the rounding of double precision (1e-16)."""


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
    tested by the method of Moeller and Trumbore, "Fast, minimum storage ray-triangle intersection",
    J. Graphics Tools 2 (1997).

    Args:
        mesh: any mesh, mm.
        origins: (r, 3) origins, mm.
        directions: (r, 3) directions of any length except zero.
    """
    start = np.asarray(origins, dtype=np.float64).reshape(-1, 3)
    way = np.asarray(directions, dtype=np.float64).reshape(-1, 3)
    corners = mesh.triangles
    middle, reach = mesh.face_spheres
    step = max(1, _PAIRS_AT_ONCE // max(1, len(corners)))
    found = [
        _hits(corners, start[i : i + step], way[i : i + step], middle, reach, i)
        for i in range(0, len(start), step)
    ]
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
    """Return the intersections of rays, numbered from ``first``, with triangles (t, 3, 3).

    Args:
        start, way: (r, 3) origins and directions.
        middle: (t, 3) centres of the triangles' bounding spheres.
        reach: (t,) squares of their radii.
        first: number of the first ray.
    """
    unit = way / np.linalg.norm(way, axis=1, keepdims=True)
    along = _products(unit, middle) - np.einsum("ri,ri->r", unit, start)[:, None]
    square = np.einsum("ri,ri->r", start, start)[:, None] - 2.0 * _products(start, middle)
    square += np.einsum("ti,ti->t", middle, middle) - reach
    scale = max(np.abs(start).max(initial=0.0), np.abs(middle).max(initial=0.0))
    ray, face = np.nonzero(square - along**2 <= _NEAR * scale**2)
    o, d, a = start[ray], way[ray], corners[face, 0]
    edge_1, edge_2 = corners[face, 1] - a, corners[face, 2] - a
    p = np.cross(d, edge_2)
    with np.errstate(divide="ignore", invalid="ignore"):
        inverse = 1.0 / np.einsum("ki,ki->k", p, edge_1)
        t = o - a
        u = np.einsum("ki,ki->k", t, p) * inverse
        q = np.cross(t, edge_1)
        v = np.einsum("ki,ki->k", q, d) * inverse
        distance = np.einsum("ki,ki->k", q, edge_2) * inverse
        hit = (u >= 0) & (v >= 0) & (u + v <= 1) & (distance > 0) & np.isfinite(inverse)
    return RayHits(ray[hit] + first, distance[hit], face[hit])


def _products(one: NDArray[np.float64], other: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the inner products (r, t) of vectors (r, 3) and (t, 3)."""
    # Sums of outer products rather than `@`, whose threads cost more than they save.
    result = np.multiply.outer(one[:, 0], other[:, 0])
    for axis in (1, 2):
        result += np.multiply.outer(one[:, axis], other[:, axis])
    return result
