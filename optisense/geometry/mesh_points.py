"""Points on meshes: the nearest ones, points spread evenly, and points that move with a mesh."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from optisense.array_types import FloatArray, FloatingArray
from optisense.errors import ContactError
from optisense.geometry.mesh import TriangleMesh

_SAME = 1e-9
"""Distance (mm) within which a point coincides with a vertex. It is far above the rounding of
coordinates in double precision (1e-14 mm)."""
_NEAREST, _LARGEST = 64, 256
"""Numbers of faces that are tested for each point: those with the nearest centres, and the largest
of all, whose centres may be far from points on them. A vertex of a mesh has six faces on average,
and parts have few large faces."""
_SLACK = 1e-4
"""Barycentric weight by which a point may be outside a face: 1e-4 of its size, for rounding."""


def closest_place(mesh: TriangleMesh, point: ArrayLike) -> tuple[int, FloatArray]:
    """Return the place of a mesh that is nearest to a point (3,): the face, and its point (3,), mm.

    Raises:
        ContactError: a coordinate is not a finite number.
    """
    where = np.asarray(point, dtype=np.float64).reshape(3)
    if not np.isfinite(where).all():
        raise ContactError(
            "a coordinate of a contact point is not a finite number",
            hint="Give x, y, z in mm",
        )
    middle, square = mesh.face_spheres
    away, radius = np.linalg.norm(middle - where, axis=1), np.sqrt(square)
    near = np.flatnonzero(away - radius <= (away + radius).min())
    on_faces = closest_points(TriangleMesh(mesh.vertices, mesh.faces[near]), where)
    distance = np.linalg.norm(on_faces - where, axis=1)
    face = int(np.argmin(np.where(np.isfinite(distance), distance, np.inf)))
    return int(near[face]), np.asarray(on_faces[face], dtype=np.float64)


def closest_points(mesh: TriangleMesh, point: FloatArray) -> FloatArray:
    """Return the point (m, 3), mm, of each face that is nearest to `point` (3,), mm."""
    return closest_on_triangles(np.broadcast_to(point, (len(mesh.faces), 3)), mesh.triangles)


def closest_on_triangles(points: FloatArray, triangles: FloatArray) -> FloatArray:
    """Return the point (k, 3), mm, of each triangle (k, 3, 3) nearest to its point (k, 3)."""
    edges = np.roll(triangles, -1, axis=1) - triangles
    squares = np.maximum(np.einsum("kei,kei->ke", edges, edges), 1e-300)
    way = points[:, None] - triangles
    along = (np.einsum("kei,kei->ke", way, edges) / squares).clip(0.0, 1.0)
    on_edges = triangles + along[:, :, None] * edges
    rows = np.arange(len(points))
    rim = on_edges[rows, np.linalg.norm(on_edges - points[:, None], axis=2).argmin(axis=1)]
    vector = np.cross(edges[:, 0], edges[:, 1])
    normal = vector / np.maximum(np.linalg.norm(vector, axis=1, keepdims=True), 1e-300)
    foot = points - np.einsum("ki,ki->k", way[:, 0], normal)[:, None] * normal
    inward = np.cross(normal[:, None], edges)
    within = (np.einsum("kei,kei->ke", inward, foot[:, None] - triangles) >= 0.0).all(axis=1)
    within &= np.linalg.norm(vector, axis=1) > 0.0
    return np.where(within[:, None], foot, rim)


def distance_within(mesh: TriangleMesh, point: FloatArray, reach: float) -> float:
    """Return the distance (mm) of a point (3,) from a mesh; infinite beyond about `reach` (mm)."""
    low, high = mesh.face_bounds
    near = ((low < point + reach) & (high > point - reach)).all(axis=1)
    if not near.any():
        return float("inf")
    part = mesh.with_faces(mesh.faces[near])
    return float(np.linalg.norm(closest_points(part, point) - point, axis=1).min())


def spread_points(mesh: TriangleMesh, count: int) -> tuple[NDArray[np.int64], FloatArray]:
    """Spread a number of points over a mesh, each of which stands for an equal share of its area.
    Return the face (count,) that each lies on, and the points (count, 3), mm, which are random
    within their faces, but always the same.
    """
    sums = np.cumsum(mesh.face_areas)
    faces = np.searchsorted(sums, (np.arange(count) + 0.5) / count * sums[-1])
    weights = np.random.default_rng(0).dirichlet(np.ones(3), count)
    return faces, np.einsum("kc,kci->ki", weights, mesh.triangles[faces])


def surface_samples(
    vertices: FloatingArray, faces: NDArray[np.integer], spacing: float
) -> tuple[FloatingArray, NDArray[np.integer], FloatingArray]:
    """Spread points evenly over a mesh, about one per ``spacing`` squared. Return the points (3,
    n), mm, the face (n,) that each lies on, and its share (n,), mm^2, of the area of the face.
    """
    a, b, c = (vertices[faces[:, k]].T.copy() for k in range(3))
    area = np.linalg.norm(np.cross((b - a).T, (c - a).T), axis=1) / 2
    count = np.maximum(1, np.ceil(area / spacing**2)).astype(int)
    owner = np.repeat(np.arange(len(faces)), count)
    # The R2 sequence (Roberts 2018), folded into the triangle by the square-root map. One sequence
    # runs through all faces; restarted in each, it would favour the same corner of small faces and
    # concentrate area in the middle of a fan.
    order = np.arange(1, len(owner) + 1)
    u = np.mod(0.5 + 0.7548776662466927 * order, 1.0)
    v = np.mod(0.5 + 0.5698402909980532 * order, 1.0)
    root = np.sqrt(u)
    points = np.empty((3, len(owner)))
    for k in range(3):
        across = b[k][owner] * (1 - v) + c[k][owner] * v
        points[k] = a[k][owner] * (1 - root) + across * root
    return points, owner, (area / count)[owner]


@dataclass(frozen=True)
class Anchors:
    """Points as weighted means of a mesh's vertices.

    Attributes:
        corners: (n, 3) numbers of vertices.
        weights: (n, 3) weights, which add up to 1.
    """

    corners: NDArray[np.int64]
    weights: FloatArray

    def on(self, vertices: FloatArray) -> FloatArray:
        """Return the points (n, 3), mm, for positions (v, 3) of the vertices."""
        moved: FloatArray = np.einsum("nk,nkc->nc", self.weights, vertices[self.corners])
        return moved


def anchored(
    points: FloatArray, mesh: TriangleMesh, tolerance: float
) -> tuple[Anchors, NDArray[np.bool_]]:
    """Return the anchors of points (n, 3), mm, on a mesh, and a mask (n,) of those that are within
    a tolerance (mm) of it; the anchors of others are arbitrary.
    """
    from scipy.spatial import cKDTree  # takes a tenth of a second to load

    distance, vertex = cKDTree(mesh.vertices).query(points)
    corners = np.repeat(vertex[:, None], 3, axis=1).astype(np.int64)
    weights = np.tile([1.0, 0.0, 0.0], (len(points), 1))
    found = distance <= _SAME
    rest = np.flatnonzero(~found)
    if len(rest) == 0:
        return Anchors(corners, weights), found
    near = min(_NEAREST, len(mesh.faces))
    _, nearest = cKDTree(mesh.triangles.mean(axis=1)).query(points[rest], k=near)
    largest = np.argsort(-mesh.face_areas)[:_LARGEST]
    faces = np.concatenate(
        [nearest.reshape(len(rest), near), np.tile(largest, (len(rest), 1))], axis=1
    )
    a, b, c = (mesh.vertices[mesh.faces[faces, k]] for k in range(3))
    normal = mesh.face_normals[faces]
    off = points[rest, None] - a
    twice = np.maximum(2 * mesh.face_areas[faces], 1e-300)
    second = np.einsum("nfc,nfc->nf", np.cross(off, c - a), normal) / twice
    third = np.einsum("nfc,nfc->nf", np.cross(b - a, off), normal) / twice
    parts = np.stack([1 - second - third, second, third], axis=2)
    height = np.abs(np.einsum("nfc,nfc->nf", off, normal))
    on = (height <= tolerance) & (parts.min(axis=2) >= -_SLACK)
    first = on.argmax(axis=1)
    row = np.arange(len(rest))
    there = on[row, first]
    corners[rest[there]] = mesh.faces[faces[row, first]][there]
    weights[rest[there]] = parts[row, first][there]
    found[rest] = there
    return Anchors(corners, weights), found
