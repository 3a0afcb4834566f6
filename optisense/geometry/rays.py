"""Intersections of straight rays with a mesh, without an acceleration structure."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from optisense.geometry.mesh import TriangleMesh

_PAIRS_AT_ONCE = 2_000_000
"""Number of pairs of ray and face that are tested together, which bounds the memory of the
arrays."""


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

    The method is that of Moeller and Trumbore, "Fast, minimum storage ray-triangle intersection",
    J. Graphics Tools 2 (1997); each ray is tested against each triangle.

    Args:
        mesh: any mesh, mm.
        origins: (r, 3) origins, mm.
        directions: (r, 3) directions of any length except zero.
    """
    start = np.asarray(origins, dtype=np.float64).reshape(-1, 3)
    way = np.asarray(directions, dtype=np.float64).reshape(-1, 3)
    a = mesh.triangles[:, 0]
    edge_1 = mesh.triangles[:, 1] - a
    edge_2 = mesh.triangles[:, 2] - a
    step = max(1, _PAIRS_AT_ONCE // max(1, len(a)))
    found: list[RayHits] = []
    for first in range(0, len(start), step):
        o, d = start[first : first + step, None], way[first : first + step, None]
        p = np.cross(d, edge_2)
        determinant = np.einsum("rtk,tk->rt", p, edge_1)
        with np.errstate(divide="ignore", invalid="ignore"):
            inverse = 1.0 / determinant
            t = o - a
            u = np.einsum("rtk,rtk->rt", t, p) * inverse
            q = np.cross(t, edge_1)
            v = np.einsum("rtk,rtk->rt", q, np.broadcast_to(d, q.shape)) * inverse
            distance = np.einsum("rtk,tk->rt", q, edge_2) * inverse
            hit = (u >= 0) & (v >= 0) & (u + v <= 1) & (distance > 0) & np.isfinite(inverse)
        ray, face = np.nonzero(hit)
        found.append(RayHits(ray + first, distance[ray, face], face))
    ray, distance, face = (np.concatenate(parts) for parts in zip(*found, strict=True))
    order = np.lexsort([distance, ray])
    return RayHits(ray[order], distance[order], face[order])
