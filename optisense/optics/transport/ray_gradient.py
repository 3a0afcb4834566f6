"""Derivatives of chief rays by the motion of surfaces and camera, computed by Dr.Jit.

Each ray's path is followed a second time, with every hit written as a smooth function of the
corners of the triangle that was met; the sequence of triangles is taken as given. This misses rays
that begin or cease to arrive, or that take another path, because an edge moves past them. These
boundaries in the picture are found between pixels (`ray_edges`), and their motion is part of the
derivative.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from optisense.array_types import FloatArray
from optisense.errors import NoDerivativeError
from optisense.geometry import TriangleMesh
from optisense.geometry.shading_normals import smooth_corners
from optisense.optics.backend.arrays import floats, indices
from optisense.optics.camera.projection import Pose, RayCamera
from optisense.optics.scene.interfaces import refract
from optisense.optics.scene.ray_scene import Piece, RayScene, leave
from optisense.optics.scene.surfaces import Region
from optisense.optics.transport._ray_edges import Discontinuity, PathVertex, find_edges, walk
from optisense.optics.transport.chief_rays import sees_nothing, trace_chief_rays, trace_path_codes


@dataclass(frozen=True)
class RayGradient:
    """Derivatives of a number that depends on chief rays.

    Attributes:
        parts: by part name, derivatives (n, 3) with respect to the position of each vertex, per mm.
        camera: (13,) derivatives with respect to the camera's position (per mm), the three rows of
            its axes, and its field of view (per degree).
    """

    parts: dict[str, FloatArray]
    camera: FloatArray


class DifferentiableRays:
    """Chief rays of one shape of a sensor, with the graph of how they came about.

    Attributes:
        codes: (h, w) result of `trace_path_codes`: 0 where a ray does not arrive; neighbours of
            equal code take the same path.
        hit: (h, w) mask of the k rays that arrive.
        cosine: (k,) cosine of the angle between ray and normal, in the order of `hit`; 1 is
            perpendicular.
        weight: (k,) area of the picture that each ray stands for, pixels: 1, and more or less
            beside a boundary, depending on its place between two pixels.
        points: (k, 3) end points, mm.
        density: (k,) share of the triangles of the sensing surface per area (1/mm²) where each ray
            arrives: 1 over the triangle's area and the number of triangles.
        surface_area: area of the sensing surface, mm².
        edges: the boundaries; None where there are none.
    """

    def __init__(self, scene: RayScene, camera: RayCamera, moving: dict[str, TriangleMesh]) -> None:
        """Trace the rays, and record the computation for `pull_back`.

        Args:
            moving: by part name, the meshes with respect to whose vertices derivatives are wanted.
                They must be sheets, and the scene's pieces have the same names.

        Raises:
            NoDerivativeError: a moving part is no sheet.
            RenderError: no ray arrives.
        """
        pieces = scene.pieces
        known = {piece.name for piece in pieces}
        for name in moving:
            if name not in known:
                raise NoDerivativeError(
                    f"chief rays have no derivative by the shape of part '{name}'",
                    hint="Only surfaces can move here (mirrors, sensing surfaces, blockers)",
                )
        self._sheets = {name: _Sheet.of(mesh) for name, mesh in moving.items()}
        self._pieces = [self._sheets[p.name].piece(p) if p.name in moving else p for p in pieces]
        same = all(a is b for a, b in zip(self._pieces, scene.pieces, strict=True))
        self._scene = scene if same else RayScene(self._pieces, table=scene.table, robust=True)
        self._starts = np.cumsum([0] + [len(p.vertices) for p in self._pieces])
        self._camera = camera
        shape = camera.height, camera.width
        middle = np.arange(camera.width * camera.height)
        x, y = middle % camera.width + 0.5, middle // camera.width + 0.5
        self.codes = codes = trace_path_codes(self._scene, camera, x, y).reshape(shape)
        self.hit = codes > 0
        if not self.hit.any():
            raise sees_nothing(trace_chief_rays(self._scene, camera), self._scene)
        self.edges = find_edges(self._scene, camera, codes)
        self._vertices = floats(self._scene.vertices)
        self._faces = indices(self._scene.faces)
        turning = self._boundary_slopes()
        self._poses = [camera.pose(int(self.hit.sum()))]
        if self.edges is not None:
            self._poses.append(camera.pose(len(self.edges.x)))
        self._inputs = [*self._numbers(), *([self._vertices] if moving else [])]
        dr.enable_grad(*self._inputs)
        self._normals = self._vertex_normals()
        self._record(x[self.hit.ravel()], y[self.hit.ravel()])
        self.weight = self._record_edges(*turning)

    def _record(self, x: NDArray[np.floating], y: NDArray[np.floating]) -> None:
        """Record the rays that arrive as functions of the moving vertices and the camera."""
        origin, direction = self._camera.rays(floats(x), floats(y), self._poses[0])
        cosine = dr.zeros(mi.Float, len(x))
        arrived_at = dr.zeros(mi.Point3f, len(x))
        face = dr.zeros(mi.UInt32, len(x))
        for stop in walk(self._scene, origin, direction):
            point, shading, origin, direction, before = self._follow(stop, origin, direction)
            cosine = dr.select(stop.arrived, dr.abs(dr.dot(before, shading)), cosine)
            arrived_at = dr.select(stop.arrived, point, arrived_at)
            face = dr.select(stop.arrived, stop.face, face)
            dr.eval(origin, direction, cosine, arrived_at, face)
        self._outputs = cosine, arrived_at
        self.cosine = np.asarray(dr.detach(cosine), dtype=np.float64)
        self.points = np.asarray(dr.detach(arrived_at), dtype=np.float64).T
        areas = self._sensing_areas()
        self.surface_area = float(areas.sum())
        self.density = 1.0 / (np.count_nonzero(areas) * areas[np.asarray(face)])

    def _sensing_areas(self) -> FloatArray:
        """Return the area (f,), mm², of each triangle of sensing surfaces, and 0 for all others."""
        areas = []
        for piece in self._pieces:
            a, b, c = (np.asarray(piece.vertices, np.float64)[piece.faces[:, k]] for k in range(3))
            area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
            areas.append(area * (piece.surface.region is Region.SENSING))
        return np.concatenate(areas)

    def _follow(
        self, stop: PathVertex, origin: mi.Point3f, direction: mi.Vector3f
    ) -> tuple[mi.Point3f, mi.Vector3f, mi.Point3f, mi.Vector3f, mi.Vector3f]:
        """Return hit points, shading normals, continuing rays and directions of arrival."""
        point, normal, shading = _hit(
            self._vertices,
            self._faces,
            self._normals,
            stop.face,
            stop.smooth,
            origin,
            direction,
            stop.valid,
        )
        # Reflected rays are excluded from refraction, whose square root has no derivative there.
        relative = dr.select(stop.turned | ~stop.goes_on, 1.0, stop.eta)
        _, reflected, transmitted, _ = refract(direction, shading, relative)
        onward = dr.select(stop.turned, reflected, transmitted)
        start = leave(point, dr.detach(normal), dr.detach(onward))
        return (
            point,
            shading,
            dr.select(stop.goes_on, start, origin),
            dr.select(stop.goes_on, onward, direction),
            direction,
        )

    def _boundary_slopes(self) -> tuple[FloatArray, FloatArray]:
        """Return the derivatives (k,) of `_boundary` along x and along y of the film, per pixel."""
        if self.edges is None:
            return np.zeros(0), np.zeros(0)
        self._normals = self._vertex_normals()
        x, y = floats(self.edges.x), floats(self.edges.y)
        dr.enable_grad(x, y)
        dr.backward(dr.sum(self._boundary(x, y, self._camera.pose())))
        by_x, by_y = (np.asarray(each, dtype=np.float64) for each in _evaluated([x, y]))
        return by_x, by_y

    def _boundary(self, x: mi.Float, y: mi.Float, pose: Pose) -> mi.Float:
        """Return a function of film positions and moving things that is 0 on boundaries."""
        edges = self.edges
        assert edges is not None
        depth, cause, first, second = (
            indices(v) for v in (edges.depth, edges.cause, edges.first, edges.second)
        )
        at_edge, at_crossing, at_limit = (
            cause == int(c)
            for c in (Discontinuity.EDGE, Discontinuity.CROSSING, Discontinuity.TOTAL_REFLECTION)
        )
        value = dr.zeros(mi.Float, len(edges.x))
        # Up to the surface that separates two rays, both take the same path as the ray between
        # them.
        origin, direction = self._camera.rays(x, y, pose)
        for number, stop in enumerate(walk(self._scene, origin, direction)):
            here = depth == number
            _, shading, start, onward, _ = self._follow(stop, origin, direction)
            cosine = dr.dot(direction, shading)
            into = dr.select(cosine < 0, dr.rcp(stop.eta), stop.eta)
            refracts = 1 - dr.square(into) * (1 - dr.square(cosine))
            value = dr.select(here & at_limit & stop.valid, refracts, value)
            a = dr.gather(mi.Point3f, self._vertices, first, here & at_edge)
            b = dr.gather(mi.Point3f, self._vertices, second, here & at_edge)
            aside = dr.cross(b - a, direction)
            passes = dr.dot(aside, origin - a) / dr.maximum(dr.norm(dr.detach(aside)), 1e-12)
            value = dr.select(here & at_edge, passes, value)
            ahead = self._distance(first, origin, direction, here & at_crossing)
            ahead -= self._distance(second, origin, direction, here & at_crossing)
            value = dr.select(here & at_crossing, ahead, value)
            origin = dr.select(depth > number, start, origin)
            direction = dr.select(depth > number, onward, direction)
            dr.eval(origin, direction, value)
        return value

    def _distance(
        self, face: mi.UInt32, origin: mi.Point3f, direction: mi.Vector3f, active: mi.Bool
    ) -> mi.Float:
        """Return the distance (mm) along rays to the planes of triangles; 0 where not active."""
        corner = dr.gather(mi.Vector3u, self._faces, face, active)
        a, b, c = (dr.gather(mi.Point3f, self._vertices, corner[k], active) for k in range(3))
        cross = dr.cross(b - a, c - a)
        steep = dr.select(active, dr.dot(direction, cross), 1.0)
        return dr.select(active, dr.dot(a - origin, cross) / steep, 0.0)

    def _record_edges(self, by_x: FloatArray, by_y: FloatArray) -> FloatArray:
        """Record the boundaries as functions of all moving things; return the weights of the rays
        that arrive.

        A boundary point stands for the boundary's crossing of a row or a column of pixels. The
        squares of the components of the boundary's normal, which add up to 1, are the weights of
        its crossings of rows and of columns.
        """
        weight = np.ones(int(self.hit.sum()))
        edges = self.edges
        if edges is None:
            return weight
        self._value = self._boundary(floats(edges.x), floats(edges.y), self._poses[1])
        square = by_x**2 + by_y**2
        along = np.where(edges.along_x, by_x, by_y)
        known = (edges.cause != Discontinuity.UNKNOWN) & np.isfinite(square) & (square > 0)
        self._per_value = np.where(known, -along / np.where(known, square, 1.0), 0.0)
        share = np.where(known, along**2 / np.where(known, square, 1.0), 0.0)
        order = np.cumsum(self.hit.ravel()) - 1
        self._sides = []
        for pixel, sign in ((edges.before, 1.0), (edges.after, -1.0)):
            there = self.hit.ravel()[pixel]
            self._sides.append((there, order[pixel]))
            np.add.at(weight, order[pixel][there], (sign * share * edges.side)[there])
        return weight

    def _vertex_normals(self) -> mi.Float:
        """Return all vertices' normals; those of moving sheets depend on their vertices."""
        fixed = np.zeros((self._starts[-1], 3), dtype=np.float32)
        for piece, start in zip(self._pieces, self._starts[:-1], strict=True):
            if piece.normals is not None and piece.name not in self._sheets:
                fixed[start : start + len(piece.vertices)] = piece.normals
        normals = floats(fixed)
        for piece, start in zip(self._pieces, self._starts[:-1], strict=True):
            if piece.name in self._sheets:
                corners = indices(np.asarray(piece.faces) + start)
                normals = normals + _smooth_normals(self._vertices, corners, len(fixed))
        return normals

    def pull_back(
        self,
        cosine: FloatArray | None = None,
        weight: FloatArray | None = None,
        points: FloatArray | None = None,
    ) -> RayGradient:
        """Return the derivatives of a number with respect to vertices and camera.

        Args:
            cosine, weight: (k,) derivatives of the number with respect to these attributes; None
                for 0.
            points: (k, 3) derivatives of the number with respect to the end points; None for 0.
        """
        loss = mi.Float(0)
        for output, slope in zip(self._outputs, (cosine, points), strict=True):
            if slope is None:
                continue
            given = dr.unravel(type(output), floats(slope)) if slope.ndim > 1 else floats(slope)
            loss += dr.sum(dr.dot(output, given))
        if weight is not None and self.edges is not None:
            sides = [np.where(there, weight[number], 0.0) for there, number in self._sides]
            loss += dr.sum(self._value * floats(self._per_value * (sides[0] - sides[1])))
        # The recorded graph is kept for the next call, whose gradients begin at 0 again.
        for value in self._inputs:
            dr.clear_grad(value)
        dr.backward(loss, flags=dr.ADFlag.ClearInterior)
        slopes = [np.asarray(each, dtype=np.float64) for each in _evaluated(self._inputs)]
        parts = {}
        for piece, start in zip(self._pieces, self._starts[:-1], strict=True):
            sheet = self._sheets.get(piece.name)
            if sheet is not None:
                moved = slopes[-1].reshape(-1, 3)[start : start + len(piece.vertices)]
                parts[piece.name] = sheet.gathered(moved)
        count = len(self._numbers())
        camera = np.concatenate([np.atleast_2d(each).sum(axis=1) for each in slopes[:count]])
        return RayGradient(parts, camera.reshape(len(self._poses), -1).sum(axis=0))

    def _numbers(self) -> list[mi.Float | mi.Point3f | mi.Vector3f]:
        """Return the variables of all camera poses."""
        return [value for pose in self._poses for value in pose.numbers()]


@dataclass(frozen=True)
class _Sheet:
    """A moving, smooth mesh, and the index of its vertex for each vertex of the piece."""

    mesh: TriangleMesh
    source: NDArray[np.integer]
    count: int

    @classmethod
    def of(cls, mesh: TriangleMesh) -> _Sheet:
        source, faces, normals = smooth_corners(mesh)
        smooth = TriangleMesh(mesh.vertices[source], faces, normals)
        return cls(smooth, source, len(mesh.vertices))

    def piece(self, like: Piece) -> Piece:
        """Return ``like`` if it is already smooth and whole, else a piece that is."""
        if like.normals is not None and np.array_equal(like.vertices, self.mesh.vertices):
            return like
        mesh = self.mesh
        return Piece(like.name, mesh.vertices, mesh.faces, like.surface, mesh.normals)

    def gathered(self, slopes: FloatArray) -> FloatArray:
        total = np.zeros((self.count, 3))
        np.add.at(total, self.source, slopes)
        return total


def _hit(
    vertices: mi.Float,
    faces: mi.UInt32,
    normals: mi.Float,
    face: mi.UInt32,
    smooth: mi.Bool,
    origin: mi.Point3f,
    direction: mi.Vector3f,
    active: mi.Bool,
) -> tuple[mi.Point3f, mi.Vector3f, mi.Vector3f]:
    """Return the point, face normal and shading normal where rays meet the planes of triangles."""
    corner = dr.gather(mi.Vector3u, faces, face, active)
    a, b, c = (dr.gather(mi.Point3f, vertices, corner[k], active) for k in range(3))
    side, other = b - a, c - a
    cross = dr.cross(side, other)
    point = origin + direction * (dr.dot(a - origin, cross) / dr.dot(direction, cross))
    area = dr.rcp(dr.squared_norm(cross))
    inner = point - a
    u = dr.dot(dr.cross(inner, other), cross) * area
    v = dr.dot(dr.cross(side, inner), cross) * area
    normal = dr.normalize(cross)
    na, nb, nc = (dr.gather(mi.Vector3f, normals, corner[k], smooth) for k in range(3))
    blended = dr.normalize(na * (1 - u - v) + nb * u + nc * v)
    blended = dr.mulsign(blended, dr.dot(dr.detach(blended), dr.detach(normal)))
    return mi.Point3f(point), normal, dr.select(smooth, blended, normal)


def _evaluated(inputs: list[Any]) -> list[Any]:
    """Return the gradients of inputs by one kernel: separate ones would repeat the work."""
    slopes = [dr.grad(value) for value in inputs]
    dr.eval(slopes)
    return slopes


def _smooth_normals(vertices: mi.Float, corners: mi.UInt32, count: int) -> mi.Float:
    """Return normals (3 count,) weighted by corner angles; 0 for vertices without a face."""
    index = dr.arange(mi.UInt32, dr.width(corners) // 3) * 3
    ids = [dr.gather(mi.UInt32, corners, index + k) for k in range(3)]
    a, b, c = (dr.gather(mi.Point3f, vertices, i) for i in ids)
    sides = [b - a, c - b, a - c]
    cross = dr.cross(sides[0], -sides[2])
    twice_area = dr.norm(cross)
    normal = cross / twice_area
    total = dr.zeros(mi.Float, 3 * count)
    for k in range(3):
        angle = dr.atan2(twice_area, -dr.dot(sides[k], sides[k - 1]))
        dr.scatter_add(total, normal * angle, ids[k])
    summed = dr.gather(mi.Vector3f, total, dr.arange(mi.UInt32, count))
    length = dr.norm(dr.detach(summed))
    unit = dr.select(length > 0, dr.normalize(dr.select(length > 0, summed, 1.0)), 0.0)
    return dr.ravel(unit)
