"""Coincident patches of two meshes with any triangles, and cutting along their borders.

Two faces coincide where, over a common patch, they are no farther apart than a tolerance and
their planes nearly parallel. Patches are found pairwise and cut out in the plane of the face.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import manifold3d
import numpy as np
import shapely
from numpy.typing import NDArray

from optisense.array_types import FloatArray
from optisense.geometry._box_pairs import PAIRS_AT_ONCE, overlapping_boxes
from optisense.geometry._flat_polygons import (
    THINNEST,
    area_and_length,
    common,
    contains,
    heights_over,
    interpolated,
    is_shape,
    lie_apart,
)
from optisense.geometry.mesh import TriangleMesh
from optisense.geometry.mesh_points import spread_points
from optisense.geometry.shading_normals import shaded

PARALLEL = float(np.cos(np.radians(10.0)))
"""Smallest cosine between the normals of coincident faces (10 degrees); faces of two tessellations
of one curved surface differ by a few degrees at most."""

_GRID = 1e-7
"""Side (mm) of the grid to which cut polygons are rounded, so that neighbouring cuts close: far
below any dimension of a part, and far above the rounding of double precision."""

SEAM_SAMPLES = 1000
"""Number of points on the faces of a solid near another one at which their distance is measured: a
film of air over 1 % of these faces is met by ten."""

Pairs = NDArray[np.int64]


@dataclass(frozen=True)
class Overlay:
    """The pairs of faces of two meshes that coincide somewhere.

    Attributes:
        first, second: the meshes.
        pairs: (k, 2) int64, face of `first` and face of `second`.
    """

    first: TriangleMesh
    second: TriangleMesh
    pairs: Pairs

    def reversed(self) -> Overlay:
        """Return the same coincidences with the meshes exchanged."""
        return Overlay(self.second, self.first, self.pairs[:, ::-1])


def find_coincident(
    first: TriangleMesh, second: TriangleMesh, tolerance: float, facing: bool
) -> Overlay:
    """Find the pairs of faces of two meshes that coincide within a tolerance, mm.

    With `facing`, only faces with opposite normals count (solids that touch); otherwise normals may
    also agree.
    """
    if not boxes_overlap(first, second, -tolerance):
        return Overlay(first, second, np.zeros((0, 2), dtype=np.int64))
    twins = _twins(first, second, tolerance)
    batches = itertools.chain(
        np.split(twins, range(PAIRS_AT_ONCE, len(twins), PAIRS_AT_ONCE)),
        _near_pairs(first, second, tolerance, without=twins),
    )
    pairs = [_coincident(first, second, batch, tolerance, facing) for batch in batches]
    return Overlay(first, second, np.concatenate(pairs))


def _coincident(
    first: TriangleMesh, second: TriangleMesh, pairs: Pairs, tolerance: float, facing: bool
) -> Pairs:
    """Return those of some pairs of faces that coincide; see `find_coincident`."""
    cosine = np.einsum(
        "ij,ij->i", first.face_normals[pairs[:, 0]], second.face_normals[pairs[:, 1]]
    )
    pairs = pairs[(-cosine if facing else np.abs(cosine)) > PARALLEL]
    frames = _Frames.of(first, pairs[:, 0])
    corners = frames.flat(second.triangles[pairs[:, 1]])
    height = corners[:, :, 2]
    near = (height.min(axis=1) <= tolerance) & (height.max(axis=1) >= -tolerance)
    near &= ~lie_apart(frames.corners, corners[:, :, :2]) & ~lie_apart(
        corners[:, :, :2], frames.corners
    )
    pairs, frames, corners = pairs[near], frames.take(near), corners[near]
    inside = contains(corners[:, :, :2], frames.corners, tolerance=THINNEST)
    whole = inside & (
        np.abs(heights_over(frames.corners, corners)).max(axis=1, initial=0) <= tolerance
    )
    others = np.flatnonzero(~whole)
    patches = common(frames.corners[others], corners[others, :, :2])
    apart = np.abs(heights_over(patches, corners[others])).max(axis=1, initial=0)
    whole[others] = is_shape(*area_and_length(patches)) & (apart <= tolerance)
    return pairs[whole]


@dataclass(frozen=True)
class Seam:
    """Points of a solid's surface over which the surface of another solid faces it.

    Attributes:
        heights: (k,) height of the other surface over each point, mm; negative in an overlap.
        middles: (k, 3) places half-way between both surfaces, mm.
        area: area (mm^2) of the surface for which each point stands.
    """

    heights: FloatArray
    middles: FloatArray
    area: float


def sample_seam(one: TriangleMesh, other: TriangleMesh, reach: float) -> Seam:
    """Measure the distance of two closed meshes with outward normals where they face each other, up
    to a reach, mm, at points spread evenly over the faces of one of them that are near the other:
    of the one with less area there.
    """
    nothing = Seam(np.zeros(0), np.zeros((0, 3)), 0.0)
    near = np.flatnonzero(_in_reach(one, other, reach))
    facing = np.flatnonzero(_in_reach(other, one, reach))
    if len(near) == 0 or len(facing) == 0:
        return nothing
    if one.face_areas[near].sum() > other.face_areas[facing].sum():
        one, other, near, facing = other, one, facing, near
    chosen, points = spread_points(one.with_faces(one.faces[near]), SEAM_SAMPLES)
    own = near[chosen]
    ends = points + reach * np.array([[[-1.0]], [[1.0]]]) * one.face_normals[own]
    boxes = (corner[facing] for corner in other.face_bounds)
    pairs = list(overlapping_boxes(ends.min(axis=0), ends.max(axis=0), *boxes))
    if not pairs:
        return nothing
    point, face = np.concatenate(pairs, axis=1)
    face = facing[face]
    frames = _Frames.of(one, own[point])
    opposite = np.einsum("pi,pi->p", frames.axes[:, 2], other.face_normals[face]) < -PARALLEL
    point, face, frames = point[opposite], face[opposite], frames.take(opposite)
    corners = frames.flat(other.triangles[face])
    places = frames.flat(points[point, None])[:, :, :2]
    met = contains(corners[:, :, :2], places, THINNEST)
    point, height = point[met], heights_over(places[met], corners[met])[:, 0]
    order = np.lexsort([np.abs(height), point])
    first = order[np.unique(point[order], return_index=True)[1]]
    first = first[np.abs(height[first]) <= reach]
    middles = points[point[first]]
    middles += 0.5 * height[first, None] * one.face_normals[own[point[first]]]
    return Seam(height[first], middles, float(one.face_areas[near].sum()) / SEAM_SAMPLES)


def boxes_overlap(first: TriangleMesh, second: TriangleMesh, depth: float) -> bool:
    """Return whether the boxes around two meshes overlap by more than `depth` (mm) along each axis;
    a negative depth allows a gap.
    """
    if len(first.faces) == 0 or len(second.faces) == 0:
        return False
    low = np.maximum(first.bounds[0], second.bounds[0])
    high = np.minimum(first.bounds[1], second.bounds[1])
    return bool((high - low > depth).all())


def cut(mesh: TriangleMesh, overlays: list[Overlay]) -> list[TriangleMesh]:
    """Return the part of a mesh that each overlay, whose `first` it is, covers, and last the part
    that nothing covers; where several overlays overlap, the first one counts.

    Together the parts form the mesh; completely covered or free faces are kept, others are cut.
    Shading normals are those of the whole mesh: after the cut, its creases and its shape at rest
    would no longer be known.
    """
    state = _Remainder(shaded(mesh))
    return [*(state.take(overlay) for overlay in overlays), state.rest()]


class _Remainder:
    """The remainder of each face while patches are cut from it."""

    def __init__(self, mesh: TriangleMesh) -> None:
        self.mesh = mesh
        self.whole = mesh.face_areas > 0.0
        self.partial: dict[int, Any] = {}  # face -> shapely polygon in the face's frame

    def take(self, overlay: Overlay) -> TriangleMesh:
        """Cut the patches of an overlay out of the remainder, and return them."""
        pairs = overlay.pairs
        pairs = pairs[self.whole[pairs[:, 0]] | np.isin(pairs[:, 0], list(self.partial))]
        frames = _Frames.of(self.mesh, pairs[:, 0])
        corners = frames.flat(overlay.second.triangles[pairs[:, 1]])[:, :, :2]
        full = np.unique(pairs[contains(corners, frames.corners, THINNEST), 0])
        taken_whole = [face for face in full.tolist() if self.whole[face]]
        taken: dict[int, Any] = {
            face: self.partial.pop(face) for face in full.tolist() if face in self.partial
        }
        self.whole[full] = False
        rows = np.flatnonzero(~np.isin(pairs[:, 0], full))
        rows = rows[np.argsort(pairs[rows, 0], kind="stable")]
        faces, starts, group = np.unique(pairs[rows, 0], return_index=True, return_inverse=True)
        outlines = shapely.polygons(frames.corners[rows[starts]])
        for k in np.flatnonzero(~self.whole[faces]):
            outlines[k] = self.partial[int(faces[k])]
        covers = _united(overlay.second.faces[pairs[rows, 1]], corners[rows], group)
        rests = _without_slivers(shapely.difference(outlines, covers, grid_size=_GRID))
        free = shapely.is_empty(rests)
        cut_up = ~(free & self.whole[faces])
        shared = shapely.intersection(outlines[cut_up], covers[cut_up], grid_size=_GRID)
        taken_whole += faces[~cut_up].tolist()
        taken |= zip(faces[cut_up].tolist(), shared, strict=True)
        self.whole[faces] = False
        for face, rest, is_free in zip(faces.tolist(), rests, free, strict=True):
            if is_free:
                self.partial.pop(face, None)
            else:
                self.partial[face] = rest
        return _assembled(self.mesh, np.array(taken_whole, dtype=np.int64), taken)

    def rest(self) -> TriangleMesh:
        """Return what remains."""
        return _assembled(self.mesh, np.flatnonzero(self.whole), self.partial)


@dataclass(frozen=True)
class _Frames:
    """A plane coordinate system for each of k faces: origin at corner 0, x along edge 01."""

    origin: FloatArray  # (k, 3)
    axes: FloatArray  # (k, 3, 3): rows x, y, normal
    corners: FloatArray  # (k, 3, 2): the face itself, counter-clockwise

    @staticmethod
    def of(mesh: TriangleMesh, faces: NDArray[np.int64]) -> _Frames:
        """Return the frames of the given faces (k,) of a mesh."""
        corners = mesh.triangles[faces]
        x = corners[:, 1] - corners[:, 0]
        x = x / np.maximum(np.linalg.norm(x, axis=1, keepdims=True), 1e-300)
        normal = mesh.face_normals[faces]
        axes = np.stack([x, np.cross(normal, x), normal], axis=1)
        frames = _Frames(corners[:, 0], axes, np.zeros((len(faces), 3, 2)))
        return _Frames(frames.origin, axes, frames.flat(corners)[:, :, :2])

    def flat(self, points: FloatArray) -> FloatArray:
        """Return points (k, c, 3) as (x, y, height) in the frame of each face, mm."""
        return (points - self.origin[:, None]) @ self.axes.transpose(0, 2, 1)

    def take(self, which: NDArray[Any]) -> _Frames:
        """Return the frames that a mask or indices select."""
        return _Frames(self.origin[which], self.axes[which], self.corners[which])


def _twins(first: TriangleMesh, second: TriangleMesh, tolerance: float) -> Pairs:
    """Return the pairs of faces with the same corners: the common case, much faster to find."""
    kept = np.flatnonzero(_in_reach(first, second, tolerance))
    if len(kept) == 0:
        return np.zeros((0, 2), dtype=np.int64)
    from scipy.spatial import cKDTree  # takes a tenth of a second to load

    tree = cKDTree(second.triangles.mean(axis=1))
    triangles = first.triangles[kept]
    distance, other = tree.query(triangles.mean(axis=1), distance_upper_bound=tolerance)
    found = np.isfinite(distance)
    pairs = np.column_stack([kept[found], other[found]]).astype(np.int64)
    apart = triangles[found][:, :, None] - second.triangles[pairs[:, 1]][:, None]
    same = (np.linalg.norm(apart, axis=3).min(axis=2) <= tolerance).all(axis=1)
    return pairs[same]


def _in_reach(first: TriangleMesh, second: TriangleMesh, tolerance: float) -> NDArray[np.bool_]:
    """Return a mask (m,) of the faces of `first` that overlap the bounding box of `second`."""
    low, high = second.bounds[0] - tolerance, second.bounds[1] + tolerance
    lowest, highest = first.face_bounds
    reach: NDArray[np.bool_] = ((lowest <= high) & (highest >= low)).all(axis=1)
    return reach


def _near_pairs(
    first: TriangleMesh, second: TriangleMesh, tolerance: float, without: Pairs
) -> Iterator[Pairs]:
    """Find the pairs of faces, not in `without`, whose boxes, grown by `tolerance`, overlap; they
    come in batches.
    """
    reach_1, reach_2 = _in_reach(first, second, tolerance), _in_reach(second, first, tolerance)
    reach_1[without[:, 0]] = False
    reach_2[without[:, 1]] = False
    kept_1, kept_2 = np.flatnonzero(reach_1), np.flatnonzero(reach_2)
    low_1, high_1 = (corner[kept_1] for corner in first.face_bounds)
    low_2, high_2 = (corner[kept_2] for corner in second.face_bounds)
    for one, other in overlapping_boxes(low_1, high_1, low_2 - tolerance, high_2 + tolerance):
        yield np.column_stack([kept_1[one], kept_2[other]])


def _united(
    faces: NDArray[np.int32], corners: FloatArray, group: NDArray[np.int64]
) -> NDArray[np.object_]:
    """Return the union of the flat triangles (g, 3, 2), of vertices (g, 3), of each group (g,),
    which are numbered from 0.

    Edges between two of the faces of a group cancel, so that only their outline needs an overlay.
    """
    size = np.int64(faces.max(initial=0)) + 1
    starts, ends = faces.astype(np.int64), np.roll(faces, -1, axis=1).astype(np.int64)
    first = group[:, None] * size
    outer = ~np.isin((first + starts) * size + ends, (first + ends) * size + starts).ravel()
    lines = np.stack([corners, np.roll(corners, -1, axis=1)], axis=2).reshape(-1, 2, 2)[outer]
    edges = shapely.multilinestrings(shapely.linestrings(lines), indices=np.repeat(group, 3)[outer])
    united: NDArray[np.object_] = shapely.build_area(edges)
    triangles = shapely.polygons(corners)
    area = np.bincount(group, shapely.area(triangles), len(united))
    for k in np.flatnonzero(np.abs(shapely.area(united) - area) > 1e-9 * area):
        united[k] = shapely.union_all(triangles[group == k], grid_size=_GRID)
    return united


def _without_slivers(shapes: NDArray[np.object_]) -> NDArray[np.object_]:
    """Return the parts of each of some shapes (k,) that are polygons larger than rounding."""
    parts, shape = shapely.get_parts(shapes, return_index=True)
    kept = is_shape(shapely.area(parts), shapely.length(parts))
    found = np.full(len(shapes), shapely.MultiPolygon(), dtype=object)
    shapely.multipolygons(parts[kept], indices=shape[kept], out=found)
    return found


def _assembled(
    mesh: TriangleMesh, whole: NDArray[np.int64], patches: dict[int, Any]
) -> TriangleMesh:
    """Return a mesh of whole faces, and patches of other faces (given in the faces' frames)."""
    kept = mesh.with_faces(mesh.faces[np.sort(whole)]).compacted()
    faces = np.array(list(patches), dtype=np.int64)
    polygons, owner = shapely.get_parts(
        _without_slivers(np.array(list(patches.values()), dtype=object)), return_index=True
    )
    if len(polygons) == 0:
        return kept
    rings, polygon = shapely.get_rings(polygons, return_index=True)
    outer = np.diff(polygon, prepend=-1) > 0
    rings = np.where(shapely.is_ccw(rings) == outer, rings, shapely.reverse(rings))
    points, ring = shapely.get_coordinates(rings, return_index=True)
    own = np.diff(ring, append=-1) == 0  # without the last point of a ring, which is its first
    points, ring = points[own], ring[own]
    outlines = np.split(points, np.flatnonzero(np.diff(ring)) + 1)
    first_ring = np.append(np.flatnonzero(outer), len(rings))
    first_point = np.searchsorted(ring, first_ring)
    triangles = [
        np.asarray(manifold3d.triangulate(outlines[start:end])) + point
        for start, end, point in zip(first_ring, first_ring[1:], first_point, strict=False)
    ]
    frames = _Frames.of(mesh, faces).take(owner[polygon[ring]])
    vertices = frames.origin + np.einsum("pi,pij->pj", points, frames.axes[:, :2])
    normals = None
    if mesh.normals is not None:
        at_corners = mesh.normals[mesh.faces[faces]][owner[polygon[ring]]]
        normals = interpolated(at_corners, frames.corners, points)
    return TriangleMesh.joined([kept, TriangleMesh(vertices, np.concatenate(triangles), normals)])
