"""Detection of parts that overlap, by cutting into one another, or that touch."""

from __future__ import annotations

import weakref
from typing import NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from optisense.array_types import FloatArray
from optisense.geometry.containment import inside
from optisense.geometry.crossings import crossings
from optisense.geometry.mesh import TriangleMesh

CONTACT = 0.002
"""Distance (mm) below which parts touch, and depth up to which parts that overlap only touch: a
tenth of the thinnest film that a design holds (0.02 mm)."""

ROUNDS = 4
"""Number of rounds in which the faces that may cross are reduced to those in the box around the
faces of the other part; further rounds remove few."""

MOST_PROBED = 4000
"""Largest number of vertices, spread over all, that are tested for contact: 0.4 mm apart on the
skin of a GelSight Mini."""

_boxes: weakref.WeakKeyDictionary[TriangleMesh, tuple[FloatArray, FloatArray]]
_boxes = weakref.WeakKeyDictionary()
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
    near_1, near_2 = _narrowed(first, second)
    if len(near_1) and len(near_2):
        one, other = first.with_faces(first.faces[near_1]), second.with_faces(second.faces[near_2])
        found = crossings(one, other)
        deep = _depths(one, other, found.pairs) > CONTACT
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
        rows = _spread(np.flatnonzero(near))
        rows = beside[other] = rows[np.isfinite(touching(mesh, rows, other))]
    return rows


def touching(mesh: TriangleMesh, vertices: NDArray[np.int64], other: TriangleMesh) -> FloatArray:
    """Return the distances of vertices of a mesh from another one, up to `CONTACT`.

    Args:
        mesh: the mesh, mm.
        vertices: (k,) numbers of its vertices.
        other: the other mesh, mm.

    Returns:
        The distances (k,), mm; infinite where they are larger than `CONTACT`.
    """
    return near_surface(mesh.vertices[vertices], other)


def near_surface(points: FloatArray, other: TriangleMesh) -> FloatArray:
    """Return the distances (k,), mm, of points (k, 3) from a mesh; infinite beyond `CONTACT`."""
    result = np.full(len(points), np.inf)
    if len(points) == 0:
        return result
    lowest, highest = _face_boxes(other)
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
    np.minimum.at(result, point, _distances(points[point], other.triangles[face]))
    return np.where(result <= CONTACT, result, np.inf)


def _spread(rows: NDArray[np.int64]) -> NDArray[np.int64]:
    if len(rows) <= MOST_PROBED:
        return rows
    return np.asarray(rows[np.linspace(0, len(rows) - 1, MOST_PROBED).astype(np.int64)])


def _face_boxes(mesh: TriangleMesh) -> tuple[FloatArray, FloatArray]:
    """Return the lower and upper corners (m, 3), mm, of the boxes around the faces; cached."""
    boxes = _boxes.get(mesh)
    if boxes is None:
        a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
        boxes = np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)
        _boxes[mesh] = boxes
    return boxes


def _narrowed(
    first: TriangleMesh, second: TriangleMesh
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the faces of both meshes in the box around those of the other, reduced in rounds."""
    boxes = [_face_boxes(first), _face_boxes(second)]
    rows = [np.arange(len(first.faces)), np.arange(len(second.faces))]
    for turn in range(2 * ROUNDS):
        this, that = turn % 2, 1 - turn % 2
        if len(rows[0]) == 0 or len(rows[1]) == 0:
            break
        low, high = boxes[that][0][rows[that]].min(axis=0), boxes[that][1][rows[that]].max(axis=0)
        mine_low, mine_high = boxes[this][0][rows[this]], boxes[this][1][rows[this]]
        rows[this] = rows[this][((mine_low <= high) & (mine_high >= low)).all(axis=1)]
    return rows[0], rows[1]


def _depths(first: TriangleMesh, second: TriangleMesh, pairs: NDArray[np.int64]) -> FloatArray:
    """Return the depths (k,), mm, to which the faces of pairs reach through the other's plane."""
    depths = np.full(len(pairs), np.inf)
    for planes, others, this, that in ((first, second, 0, 1), (second, first, 1, 0)):
        height = np.einsum(
            "kci,ki->kc",
            others.triangles[pairs[:, that]] - planes.triangles[pairs[:, this], :1],
            planes.face_normals[pairs[:, this]],
        )
        depths = np.minimum(depths, np.minimum(height.max(axis=1), -height.min(axis=1)))
    return depths


def _distances(points: FloatArray, triangles: FloatArray) -> FloatArray:
    """Return the distances (k,), mm, between points (k, 3) and triangles (k, 3, 3), by pair."""
    edges = np.roll(triangles, -1, axis=1) - triangles
    offset = points[:, None] - triangles
    squares = np.maximum(np.einsum("kei,kei->ke", edges, edges), 1e-300)
    along = (np.einsum("kei,kei->ke", offset, edges) / squares).clip(0.0, 1.0)
    to_edges = np.linalg.norm(offset - along[:, :, None] * edges, axis=2).min(axis=1)
    normal = np.cross(edges[:, 0], edges[:, 1])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    inward = np.cross(normal[:, None], edges)
    over = (np.einsum("kei,kei->ke", inward, offset) >= 0.0).all(axis=1)
    height = np.abs(np.einsum("ki,ki->k", offset[:, 0], normal))
    return np.where(over, height, to_edges)
