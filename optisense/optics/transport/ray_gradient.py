"""How chief rays move when mirrors, other surfaces, or the camera move: derivatives by Dr.Jit.

A ray's way is followed a second time, each hit written as a smooth function of the corners of the
triangle that was met; which triangles these are is taken as given. What that misses is rays that
begin or cease to arrive because an edge moves past them. So a ray's weight fades to nothing
towards the open edges of the mirrors it meets and of the sensing surface: the weighted sum over
rays is then a continuous function, and its derivative knows of edges (the idea of smoothing
visibility: Loubet, Holzschuch and Jakob, "Reparameterizing discontinuous integrands for
differentiable rendering", ACM Trans. Graph. 38(6), 2019, treat it without bias; here the fading
is part of the function). Edges of blockers that cut off rays are not followed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from optisense.errors import RenderError
from optisense.geometry import TriangleMesh
from optisense.geometry.mesh import CREASE
from optisense.geometry.shading_normals import smooth_corners
from optisense.optics.backend.arrays import floats, indices
from optisense.optics.camera.projection import RayCamera
from optisense.optics.scene.bsdf import refract, surface_kind, surface_region
from optisense.optics.scene.ray_scene import Piece, RayScene, intersect, leave
from optisense.optics.scene.surfaces import Region, SurfaceKind
from optisense.optics.transport.chief_rays import MAX_DEPTH, sees_nothing, trace_chief_rays

FloatArray = NDArray[np.float64]

SAMPLE_PITCH = 0.2
"""mm; open edges are looked up by points so far apart along them."""


@dataclass(frozen=True)
class RayGradient:
    """Derivatives of a number that depends on chief rays.

    Attributes:
        parts: by part name (n, 3), by the place of each vertex, a mm.
        camera: (13,), by the camera's position (mm), the three rows of its axes, and its field
            of view (degrees).
    """

    parts: dict[str, FloatArray]
    camera: FloatArray


class DifferentiableRays:
    """Chief rays of one shape of a sensor, with the graph of how they came about.

    Attributes:
        hit: (h, w) which arrive.
        cosine: (k,) of those, in the order of `hit`: between ray and normal, 1 is upright.
        weight: (k,) 1 away from open edges, fading to 0 on them.
        points: (k, 3) mm.
    """

    def __init__(
        self,
        scene: RayScene,
        camera: RayCamera,
        moving: dict[str, TriangleMesh],
        fade: float,
    ) -> None:
        """Trace, and record.

        Args:
            scene: the surfaces of the sensor.
            camera: whose rays.
            moving: meshes of the parts whose vertices are asked about. They are sheets: pieces
                of the same name.
            fade: mm; within so much of an open edge a ray's weight falls to 0.

        Raises:
            RenderError: no ray arrives, or a moving part is no sheet.
        """
        pieces = scene.pieces
        known = {piece.name for piece in pieces}
        for name in moving:
            if name not in known:
                raise RenderError(
                    f"chief rays have no derivative by the shape of part '{name}'",
                    hint="Only surfaces can move here (mirrors, sensing surfaces, blockers)",
                )
        self._sheets = {name: _Sheet.of(mesh) for name, mesh in moving.items()}
        self._pieces = [self._sheets[p.name].piece(p) if p.name in moving else p for p in pieces]
        same = all(a is b for a, b in zip(self._pieces, scene.pieces, strict=True))
        self._scene = scene if same else RayScene(self._pieces, table=scene.table, robust=True)
        self._starts = np.cumsum([0] + [len(p.vertices) for p in self._pieces])
        self._camera = camera
        self._fade = fade
        rays = trace_chief_rays(self._scene, camera)
        self.hit = rays.hit
        if not self.hit.any():
            raise sees_nothing(rays)
        self._edges = _OpenEdges(self._pieces, self._starts)
        self._record()

    def _record(self) -> None:
        scene = self._scene
        pixel = indices(np.flatnonzero(self.hit.ravel()))
        x = mi.Float(pixel % self._camera.width) + 0.5
        y = mi.Float(pixel // self._camera.width) + 0.5
        self._vertices = floats(scene.vertices)
        self._pose = self._camera.pose()
        dr.enable_grad(self._vertices, *self._pose)
        faces = indices(scene.faces)
        normals = self._vertex_normals()

        origin, direction = self._camera.rays(x, y, self._pose)
        dr.eval(origin, direction)
        count = dr.width(pixel)
        active = dr.full(mi.Bool, True, count)
        weight = dr.ones(mi.Float, count)
        cosine = dr.zeros(mi.Float, count)
        arrived_at = dr.zeros(mi.Point3f, count)
        for _ in range(MAX_DEPTH):
            met = intersect(
                scene.scene,
                scene.rows,
                scene.corners,
                dr.detach(origin),
                dr.detach(direction),
                active,
            )
            kind, eta, _alpha = surface_kind(scene.table, met.surface, met.valid)
            region = surface_region(scene.table, met.surface, met.valid)
            arrived = met.valid & (kind == int(SurfaceKind.OPAQUE)) & (region != int(Region.OTHER))
            mirror = met.valid & (kind == int(SurfaceKind.MIRROR))
            reflectance, _, _, _ = refract(dr.detach(direction), met.shading_normal, eta)
            turns = mirror | (reflectance >= 1)
            face = met.face
            rough = met.shading_normal != met.normal
            smooth = met.valid & (rough.x | rough.y | rough.z)
            dr.eval(face, arrived, mirror, turns, smooth, eta)

            point, normal, shading = _hit(
                self._vertices, faces, normals, face, smooth, origin, direction, active
            )
            weight *= self._fading(point, face, active & (arrived | mirror))
            cosine = dr.select(arrived, dr.abs(dr.dot(direction, shading)), cosine)
            arrived_at = dr.select(arrived, point, arrived_at)
            active &= met.valid & ~arrived
            # A ray that is turned back takes no part in refraction, whose root has no slope there.
            relative = dr.select(turns, 1.0, eta)
            _, _, transmitted, _ = refract(direction, shading, relative)
            reflected = direction - shading * (2 * dr.dot(direction, shading))
            onward = dr.select(turns, dr.normalize(reflected), transmitted)
            origin = dr.select(active, leave(point, dr.detach(normal), dr.detach(onward)), origin)
            direction = dr.select(active, onward, direction)
            dr.eval(origin, direction, weight, cosine, arrived_at, active)
            if not dr.any(active):
                break
        self._outputs = cosine, weight, arrived_at
        self.cosine = np.asarray(dr.detach(cosine), dtype=np.float64)
        self.weight = np.asarray(dr.detach(weight), dtype=np.float64)
        self.points = np.asarray(dr.detach(arrived_at), dtype=np.float64).T

    def _vertex_normals(self) -> mi.Float:
        """Normals of all vertices; those of moving sheets as functions of their vertices."""
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

    def _fading(self, point: mi.Point3f, face: mi.UInt32, active: mi.Bool) -> mi.Float:
        places = np.asarray(dr.detach(point), dtype=np.float64).T
        first, second = self._edges.nearest(
            places, np.asarray(face), np.asarray(active), self._fade
        )
        near = indices(first >= 0) > 0
        a = dr.gather(mi.Point3f, self._vertices, indices(first.clip(0)), near)
        b = dr.gather(mi.Point3f, self._vertices, indices(second.clip(0)), near)
        along = dr.normalize(b - a)
        aside = dr.cross(point - a, along)
        distance = dr.sqrt(dr.squared_norm(aside) + 1e-12)
        share = dr.clip(distance / self._fade, 0, 1)
        return dr.select(near, share * share * (3 - 2 * share), 1.0)

    def pull_back(
        self,
        cosine: FloatArray | None = None,
        weight: FloatArray | None = None,
        points: FloatArray | None = None,
    ) -> RayGradient:
        """Derivatives of a number by shapes and camera, given those by what rays do; once only.

        Args:
            cosine, weight: (k,), points: (k, 3): derivatives of the number by these; None for 0.
        """
        loss = mi.Float(0)
        for output, slope in zip(self._outputs, (cosine, weight, points), strict=True):
            if slope is None:
                continue
            given = dr.unravel(type(output), floats(slope)) if slope.ndim > 1 else floats(slope)
            loss += dr.sum(dr.dot(output, given))
        dr.backward(loss)
        moved = np.asarray(dr.grad(self._vertices), dtype=np.float64).reshape(-1, 3)
        parts = {}
        for piece, start in zip(self._pieces, self._starts[:-1], strict=True):
            sheet = self._sheets.get(piece.name)
            if sheet is not None:
                parts[piece.name] = sheet.gathered(moved[start : start + len(piece.vertices)])
        camera = [np.ravel(np.asarray(dr.grad(value))) for value in self._pose]
        return RayGradient(parts, np.concatenate(camera).astype(np.float64))


@dataclass(frozen=True)
class _Sheet:
    """A moving mesh, smooth, and from which of its vertices each one of the piece comes."""

    mesh: TriangleMesh
    source: NDArray[np.integer]
    count: int

    @classmethod
    def of(cls, mesh: TriangleMesh) -> _Sheet:
        source, faces, normals = smooth_corners(
            mesh.triangles, mesh.faces, mesh.face_normals, CREASE
        )
        smooth = TriangleMesh(mesh.vertices[source], faces, normals)
        return cls(smooth, source, len(mesh.vertices))

    def piece(self, like: Piece) -> Piece:
        """The piece itself where it is smooth and whole already, and else such a one."""
        if like.normals is not None and np.array_equal(like.vertices, self.mesh.vertices):
            return like
        mesh = self.mesh
        return Piece(like.name, mesh.vertices, mesh.faces, like.surface, mesh.normals)

    def gathered(self, slopes: FloatArray) -> FloatArray:
        total = np.zeros((self.count, 3))
        np.add.at(total, self.source, slopes)
        return total


class _OpenEdges:
    """The open edges of mirrors and sensing surfaces, found by place."""

    def __init__(self, pieces: Sequence[Piece], starts: NDArray[np.integer]) -> None:
        self._faces_before = np.cumsum([0] + [len(piece.faces) for piece in pieces])
        self._trees: dict[int, tuple[cKDTree, NDArray[np.integer], NDArray[np.integer]]] = {}
        for number, (piece, start) in enumerate(zip(pieces, starts[:-1], strict=True)):
            surface = piece.surface
            if surface.kind is not SurfaceKind.MIRROR and surface.region is not Region.SENSING:
                continue
            edges = piece.open_edges
            if not len(edges):
                continue
            ends = np.asarray(piece.vertices, dtype=np.float64)[edges]
            length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
            counts = np.maximum(2, np.ceil(length / SAMPLE_PITCH).astype(int) + 1)
            which = np.repeat(np.arange(len(edges)), counts)
            step = np.arange(len(which)) - np.repeat(np.cumsum(counts) - counts, counts)
            share = (step / (counts[which] - 1))[:, None]
            places = ends[which, 0] * (1 - share) + ends[which, 1] * share
            self._trees[number] = cKDTree(places), which, edges + start

    def nearest(
        self,
        places: FloatArray,
        faces: NDArray[np.integer],
        active: NDArray[np.bool_],
        reach: float,
    ) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """(k,) vertices at the ends of the open edge nearest to each place; -1 where none is."""
        first = np.full(len(places), -1, dtype=np.int64)
        second = first.copy()
        number = np.searchsorted(self._faces_before, faces, side="right") - 1
        for piece, (tree, which, edges) in self._trees.items():
            rows = np.flatnonzero(active & (number == piece))
            distance, sample = tree.query(places[rows], distance_upper_bound=reach + SAMPLE_PITCH)
            found = np.isfinite(distance)
            edge = which[sample[found]]
            first[rows[found]], second[rows[found]] = edges[edge, 0], edges[edge, 1]
        return first, second


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
    """Point, face normal and shading normal where rays meet the planes of triangles."""
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


def _smooth_normals(vertices: mi.Float, corners: mi.UInt32, count: int) -> mi.Float:
    """(3 count,) vertex normals by corner angles, as `shading_normals` has them; 0 for vertices
    of no face here.
    """
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
