"""Detection of parts that overlap, by cutting into one another, or that touch."""

from __future__ import annotations

import weakref
from typing import NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from optisense.array_types import FloatArray
from optisense.geometry.containment import inside
from optisense.geometry.crossings import crossings, heights
from optisense.geometry.mesh import TriangleMesh
from optisense.geometry.mesh_points import closest_on_triangles

CONTACT = 0.002
"""Distance (mm) below which parts touch, and depth up to which parts that overlap only touch: a
tenth of the thinnest film that a design holds (0.02 mm)."""

MOST_PROBED = 4000
"""Largest number of vertices, spread over all, that are tested for contact: 0.4 mm apart on the
skin of a GelSight Mini."""

_contacts: weakref.WeakKeyDictionary[
    TriangleMesh, weakref.WeakKeyDictionary[TriangleMesh, NDArray[np.int64]]
]
_contacts = weakref.WeakKeyDictionary()


class Overlap(NamedTuple):
    """A place where two parts share space.

    Attributes:
        place: (3,) a point (mm) of the first part that is on or in the second.
        kind: "cuts into" (their surfaces cross), "is inside" or "encloses".
    """

    place: FloatArray
    kind: str


def find_overlap(first: TriangleMesh, second: TriangleMesh) -> Overlap | None:
    """Return a place where two parts share space, or None; parts that only touch (within `CONTACT`)
    do not count.

    The search finds surfaces that cross, and a part that lies completely inside another, closed
    one.
    """
    low = np.maximum(first.bounds[0], second.bounds[0])
    high = np.minimum(first.bounds[1], second.bounds[1])
    if (low > high).any():
        return None
    found = crossings(first, second)
    deep = _depths(first, second, *found.pairs.T) > CONTACT
    if deep.any():
        return Overlap(found.places[deep][0], "cuts into")
    for small, large in ((first, second), (second, first)):
        within = (small.bounds[0] > large.bounds[0]) & (small.bounds[1] < large.bounds[1])
        if within.all() and large.is_closed:
            place = small.vertices[small.faces[0, 0]]
            if inside(place[None], large)[0]:
                return Overlap(place, "is inside" if small is first else "encloses")
    return None


def touching_vertices(mesh: TriangleMesh, other: TriangleMesh) -> NDArray[np.int64]:
    """Return the vertices (k,) of a mesh that touch another one, among at most about `MOST_PROBED`;
    cached for the next call with the same meshes.
    """
    beside = _contacts.setdefault(mesh, weakref.WeakKeyDictionary())
    rows = beside.get(other)
    if rows is None:
        low, high = other.bounds[0] - CONTACT, other.bounds[1] + CONTACT
        near = ((mesh.vertices >= low) & (mesh.vertices <= high)).all(axis=1)
        rows = np.flatnonzero(near)
        if len(rows) > MOST_PROBED:
            rows = rows[np.linspace(0, len(rows) - 1, MOST_PROBED).astype(np.int64)]
        rows = beside[other] = rows[np.isfinite(near_surface(mesh.vertices[rows], other))]
    return rows


def near_surface(points: FloatArray, other: TriangleMesh) -> FloatArray:
    """Return the distances (k,), mm, of points (k, 3) from a mesh; infinite beyond `CONTACT`."""
    result = np.full(len(points), np.inf)
    if len(points) == 0:
        return result
    lowest, highest = other.face_bounds
    low, high = lowest - CONTACT, highest + CONTACT
    kept = np.flatnonzero(
        (other.face_areas > 0.0)
        & ((low <= points.max(axis=0)) & (high >= points.min(axis=0))).all(axis=1)
    )
    if len(kept) == 0:
        return result
    third, x, y = np.argsort(np.ptp(other.bounds, axis=0))
    tree = shapely.STRtree(shapely.box(low[kept, x], low[kept, y], high[kept, x], high[kept, y]))
    point, face = tree.query(shapely.points(points[:, x], points[:, y]))
    face = kept[face]
    beside = (points[point, third] >= low[face, third]) & (
        points[point, third] <= high[face, third]
    )
    point, face = point[beside], face[beside]
    nearest = closest_on_triangles(points[point], other.triangles[face])
    np.minimum.at(result, point, np.linalg.norm(points[point] - nearest, axis=1))
    return np.where(result <= CONTACT, result, np.inf)


def _depths(
    first: TriangleMesh, second: TriangleMesh, one: NDArray[np.int64], other: NDArray[np.int64]
) -> FloatArray:
    """Return the depths (k,), mm, to which the faces of pairs reach through the other's plane."""
    sides = [heights(first, one, second, other), heights(second, other, first, one)]
    return np.minimum.reduce([np.minimum(h.max(axis=1), -h.min(axis=1)) for h in sides])
