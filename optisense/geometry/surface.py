"""Coordinates (u, v) on a sensing surface, which may be curved."""

from __future__ import annotations

from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from optisense.array_types import FloatArray
from optisense.errors import ContactError, MeshError
from optisense.geometry.mesh import TriangleMesh
from optisense.geometry.mesh_points import closest_place

_ARRIVED = 1e-9
"""Remaining distance (mm) below which a walk over the surface has arrived: far above the rounding
of double precision (1e-14 mm)."""

KEPT_POINTS = 256
"""Number of places that a surface keeps with their coordinates: a press asks for the same place
several times, and the walk to it takes some milliseconds on a curved surface."""

WALL_ANGLE = 60.0
"""Smallest angle (degrees) between the normal at the origin and the normals of a fingertip's wall.
It is well above the 40 degrees of a spherical pad, and below the 90 degrees of a finger's wall."""

WALL_SHARE = 0.5
"""Smallest share of a fingertip's area that belongs to its wall; flat pads have less."""

WALL_SECTORS = 8
"""Number of sectors of azimuth that must all contain a wall. A cylindrical skin has walls in two
opposite directions only."""


class SurfacePoint(NamedTuple):
    """A place on the sensing surface.

    Attributes:
        point: (3,) float64, the position, mm.
        inward: (3,) float64, the unit normal into the gel.
    """

    point: FloatArray
    inward: FloatArray


class SensingSurface:
    """A sensing surface with coordinates (u, v) in mm.

    The point (u, v) lies at distance sqrt(u^2 + v^2) from the origin along the straightest geodesic
    in direction u * u_axis + v * v_axis, which is unfolded across each edge (Polthier and Schmies,
    1998). On a flat surface (u, v) are Cartesian coordinates.
    """

    def __init__(
        self, mesh: TriangleMesh, origin: ArrayLike, u_axis: ArrayLike, v_axis: ArrayLike
    ) -> None:
        """Define coordinates on a surface.

        Args:
            mesh: the sensing surface, mm; its face normals point into the gel.
            origin: (3,) a point (mm) whose nearest point on the surface is (0, 0).
            u_axis, v_axis: (3,) directions, which are projected on the surface at the origin; v is
                made perpendicular to u.

        Raises:
            MeshError: the mesh is empty.
            ContactError: an axis is perpendicular to the surface, or both are parallel.
        """
        mesh.validate("sensing surface", closed=False)
        self.mesh = mesh.welded()
        self._origin_face, self.origin = closest_place(self.mesh, origin)
        self._inward = normal = self.mesh.face_normals[self._origin_face]
        self.u_axis = _in_plane(np.asarray(u_axis, dtype=np.float64), [normal], "u")
        self.v_axis = _in_plane(np.asarray(v_axis, dtype=np.float64), [normal, self.u_axis], "v")
        self._points = lru_cache(maxsize=KEPT_POINTS)(self._point_found)

    def directions(self, inward: NDArray[np.floating]) -> tuple[FloatArray, FloatArray]:
        """Return the unit tangents (..., 3) along which u and v grow, for inward normals.

        They are the axes at the origin, turned by the smallest rotation that takes the normal there
        to the given one. They are perpendicular to each other everywhere, and exact on flat and on
        cylindrical surfaces.

        Args:
            inward: (..., 3) unit normals into the gel.
        """
        normals = np.asarray(inward, dtype=np.float64)
        halfway = normals + self._inward
        cosine = np.maximum(1.0 + normals @ self._inward, 1e-12)
        u, v = (
            axis - ((normals @ axis) / cosine)[..., None] * halfway
            for axis in (self.u_axis, self.v_axis)
        )
        return u, v

    def tangents(self, inward: NDArray[np.floating]) -> tuple[FloatArray, FloatArray]:
        """Return two perpendicular unit tangents (..., 3) of the surface for inward normals.

        The first one is that of `directions`. The tangents of neighbouring places are therefore
        similar all over a dome, except where the surface has turned by 180 degrees. Projections of
        `u_axis` would change their sign where the surface faces its direction.

        On a fingertip, whose wall surrounds its axis, the first tangent points along the meridian
        instead, away from the tip. Lights around the axis then have similar directions in the
        frames of all places on the wall. The frame of the origin is used at the tip itself only.

        Args:
            inward: (..., 3) unit normals into the gel.
        """
        normals = np.asarray(inward, dtype=np.float64)
        first, _ = self.directions(normals)
        if self._has_wall:
            meridian = self._inward - (normals @ self._inward)[..., None] * normals
            length = np.linalg.norm(meridian, axis=-1, keepdims=True)
            first = np.where(length > 1e-6, meridian / np.maximum(length, 1e-6), first)
        return first, np.cross(first, normals)

    @cached_property
    def _has_wall(self) -> bool:
        """Whether a wall surrounds the axis, which is the normal at the origin."""
        normals, areas = self.mesh.face_normals, self.mesh.face_areas
        is_wall = normals @ self._inward < np.cos(np.radians(WALL_ANGLE))
        if areas[is_wall].sum() < WALL_SHARE * areas.sum():
            return False
        azimuth = np.arctan2(normals[is_wall] @ self.v_axis, normals[is_wall] @ self.u_axis)
        sectors = np.floor((azimuth / (2.0 * np.pi) + 0.5) * WALL_SECTORS).astype(int)
        return len(np.unique(sectors % WALL_SECTORS)) == WALL_SECTORS

    def point_at(self, u: float, v: float) -> SurfacePoint:
        """Return the place with surface coordinates (u, v), mm.

        Raises:
            ContactError: the path to it crosses the edge of the surface.
        """
        return self._points(u, v)

    def _point_found(self, u: float, v: float) -> SurfacePoint:
        way = u * self.u_axis + v * self.v_axis
        length = float(np.hypot(u, v))
        if length == 0.0:
            return _smooth_place(self.mesh, self._origin_face, self.origin)
        face, point, left = self._walk(self._origin_face, self.origin, way / length, length)
        if left > _ARRIVED:
            raise ContactError(
                f"the place ({u:g}, {v:g}) is off the sensing surface, whose edge lies "
                f"{length - left:.2f} mm from its middle in that direction",
                hint="Choose a place nearer to the middle",
            )
        return _smooth_place(self.mesh, face, point)

    def nearest(self, point: ArrayLike) -> SurfacePoint:
        """Return the place nearest to `point` (3,), mm."""
        return nearest_place(self.mesh, point)

    def height_above(self, place: SurfacePoint) -> float:
        """Return the largest height (mm) of the surface, outward, over its tangent plane."""
        outward = (self.mesh.vertices - place.point) @ -place.inward
        return max(0.0, float(outward.max()))

    @cached_property
    def _neighbours(self) -> dict[tuple[int, int], list[int]]:
        """The faces at each edge, by its (lower, higher) vertex numbers."""
        result: dict[tuple[int, int], list[int]] = {}
        for face, (a, b, c) in enumerate(self.mesh.faces.tolist()):
            for one, other in ((a, b), (b, c), (c, a)):
                result.setdefault((min(one, other), max(one, other)), []).append(face)
        return result

    def _walk(
        self, face: int, point: FloatArray, direction: FloatArray, length: float
    ) -> tuple[int, FloatArray, float]:
        """Walk straight from a point of `face`; return the end and the remaining part of `length`
        at a border.
        """
        mesh = self.mesh
        for _ in range(10 * len(mesh.faces) + 100):
            corners = mesh.triangles[face]
            edges = np.roll(corners, -1, axis=0) - corners
            inward = np.cross(mesh.face_normals[face], edges)
            inward /= np.linalg.norm(inward, axis=1, keepdims=True)
            speed = -inward @ direction
            room = np.einsum("ij,ij->i", inward, point - corners)
            with np.errstate(divide="ignore", invalid="ignore"):
                steps = np.where(speed > 1e-12, np.maximum(room, 0.0) / speed, np.inf)
            exit_edge = int(np.argmin(steps))
            step = float(steps[exit_edge])
            if step >= length:
                return face, point + length * direction, 0.0
            point, length = point + step * direction, length - step
            ends = mesh.faces[face][[exit_edge, (exit_edge + 1) % 3]].tolist()
            across = [f for f in self._neighbours[min(ends), max(ends)] if f != face]
            if not across:
                return face, point, length
            face = across[0]
            direction = self._unfolded(direction, ends, face)
        raise MeshError(
            "the path to a place on a surface does not end, as the surface has no edge there, or "
            "its mesh has degenerate triangles",
            hint="Export the mesh of the surface again",
        )

    def _unfolded(self, direction: FloatArray, ends: list[int], face: int) -> FloatArray:
        """Return the direction after crossing the edge `ends` into `face`."""
        start = self.mesh.vertices[ends[0]]
        edge = self.mesh.vertices[ends[1]] - start
        edge = edge / np.linalg.norm(edge)
        apex = next(v for v in self.mesh.faces[face].tolist() if v not in ends)
        into = self.mesh.vertices[apex] - start
        into = into - (into @ edge) * edge
        into = into / np.linalg.norm(into)
        along = float(direction @ edge)
        turned: FloatArray = along * edge + np.sqrt(max(0.0, 1.0 - along * along)) * into
        return turned


def nearest_place(mesh: TriangleMesh, point: ArrayLike) -> SurfacePoint:
    """Return the place on a welded mesh that is nearest to `point` (3,), mm."""
    return _smooth_place(mesh, *closest_place(mesh, point))


def _smooth_place(mesh: TriangleMesh, face: int, point: FloatArray) -> SurfacePoint:
    """Return the place with the smooth normal, which is nearly that of neighbouring places."""
    smooth = mesh.vertex_normals()  # kept by the mesh
    assert smooth.normals is not None
    share = _barycentric(mesh.triangles[face], point)
    normal = share @ smooth.normals[smooth.faces[face]]
    return SurfacePoint(point, normal / np.linalg.norm(normal))


def _barycentric(triangle: FloatArray, point: FloatArray) -> FloatArray:
    """Return the barycentric coordinates (3,) of a point in the plane of three corners (3, 3)."""
    edges = (triangle[1:] - triangle[0]).T
    second, third = np.linalg.lstsq(edges, point - triangle[0], rcond=None)[0]
    return np.array([1.0 - second - third, second, third])


def _in_plane(axis: FloatArray, square_to: list[FloatArray], name: str) -> FloatArray:
    length = np.linalg.norm(axis)
    for other in square_to:
        axis = axis - (axis @ other) * other
    rest = np.linalg.norm(axis)
    if not rest > 1e-6 * length:
        raise ContactError(
            f"the {name} axis does not lie along the sensing surface",
            hint="Give two directions that are neither perpendicular to the surface nor parallel",
        )
    return axis / rest
