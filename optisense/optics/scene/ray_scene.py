"""The geometry of a sensor as one ray-traced mesh with a table of faces and a table of surfaces.

All surfaces (interfaces between media, coating, mirrors, blockers, lights, indenters) are
merged into a single Mitsuba mesh. A hit's triangle number then leads straight to its normal and
its optical data by two gathers: no virtual function calls in the inner loops, and replacing an
indenter never changes a compiled kernel.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, field
from functools import cached_property

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from optisense.array_types import FloatingArray
from optisense.geometry.connected import connected_components
from optisense.optics.backend.arrays import floats, indices
from optisense.optics.scene.interfaces import SMOOTH_ALPHA
from optisense.optics.scene.surface_table import surface_table
from optisense.optics.scene.surfaces import RAY_OFFSET, Surface, SurfaceKind

SMOOTH_FACE = 1 << 16
"""Bit in a face's record that marks interpolated normals: the first bit above those of a surface's
number, which thus is below 65,536."""

LONGEST_RAY = 2.0
"""Length of the longest ray in a shared scene, in diagonals of the sensor: rays between surfaces
have at most 1, and a camera outside of all meshes may be as far away again."""

SAME_WAY = 1e-4
"""Largest difference between the components of the unit normals (0.006 degrees) of flat facets that
form one plane for rays: far above the rounding of single precision (6e-8)."""


@dataclass(frozen=True)
class Piece:
    """A triangle mesh with one surface.

    Attributes:
        name: name of the part.
        vertices: (n, 3) mm.
        faces: (m, 3) indices of vertices; face normals point to the outside of a dielectric.
        surface: optical data of the surface.
        normals: (n, 3) shading normals at the vertices; None for flat facets.
    """

    name: str
    vertices: FloatingArray
    faces: NDArray[np.integer]
    surface: Surface
    normals: FloatingArray | None = None

    @cached_property
    def rows(self) -> NDArray[np.float32]:
        """Return rows (m, 4): the unit normal of each face, and room for a surface's number."""
        a, b, c = (self.vertices[self.faces[:, i]] for i in range(3))
        cross = np.cross(b - a, c - a)
        length = np.linalg.norm(cross, axis=1)
        # A triangle without area is never hit; it keeps its row, so that triangles keep their
        # numbers.
        rows = np.zeros((len(self.faces), 4), dtype=np.float32)
        rows[:, :3] = cross / np.where(length > 0, length, 1.0)[:, None]
        return rows

    @cached_property
    def boxes(self) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Return the lowest and the highest coordinates (3, m), mm, of each face."""
        a, b, c = (self.vertices.T.astype(np.float32)[:, self.faces[:, i]] for i in range(3))
        return np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)

    @cached_property
    def corners(self) -> NDArray[np.float32]:
        """Return corner normals (m, 3, 4) on the face normal's side, padded to four floats."""
        corners = np.zeros((len(self.faces), 3, 4), dtype=np.float32)
        if self.normals is not None:
            corners[:, :, :3] = self.normals[self.faces]
            against = np.einsum("fck,fk->fc", corners[:, :, :3], self.rows[:, :3]) < 0
            corners[against] *= -1
        return corners

    @cached_property
    def patches(self) -> NDArray[np.int64]:
        """Return the number (m,), from 0, of the smooth patch that each triangle belongs to.

        A patch consists of triangles that share vertices and their normals or, for flat facets, of
        triangles with the same normal.
        """
        if self.normals is None:
            way = np.round(self.rows[:, :3] / SAME_WAY).astype(np.int64)
            return np.unique(way, axis=0, return_inverse=True)[1].reshape(-1)
        faces = np.asarray(self.faces, dtype=np.int64)
        ends = np.concatenate([faces[:, :2], faces[:, 1:]])
        number = connected_components(len(self.vertices), *ends.T)
        return np.unique(number[faces[:, 0]], return_inverse=True)[1].reshape(-1)


@dataclass
class Ray:
    """Rays that are traced.

    Attributes:
        origin: origin, mm.
        direction: unit vector.
        active: mask of the rays that are followed.
        depth: number of surfaces that they have met.
        absorption: absorption coefficient (1/mm, per channel) of the medium that they are in; None
            in a scene without absorption.
        channel: channel of the light, 0 to 2 for R, G, B; None for light of all channels, which has
            the mean index.
    """

    origin: mi.Point3f
    direction: mi.Vector3f
    active: mi.Bool
    depth: mi.UInt32 = field(default_factory=lambda: mi.UInt32(0))
    absorption: mi.Color3f | None = None
    channel: mi.UInt32 | None = None


@dataclass
class SurfaceHit:
    """Intersections of rays with a surface.

    Attributes:
        valid: mask of the rays that hit a surface.
        distance: distance (mm) along the ray.
        point: point of intersection, mm.
        normal: unit face normal.
        shading_normal: unit normal, interpolated on smooth surfaces.
        surface: number of the surface.
        face: number of the triangle in the scene.
    """

    valid: mi.Bool
    distance: mi.Float
    point: mi.Point3f
    normal: mi.Vector3f
    shading_normal: mi.Vector3f
    surface: mi.UInt32
    face: mi.UInt32


class RayScene:
    """A merged mesh for ray tracing, with its tables on the device.

    Attributes:
        pieces: the meshes that were merged.
        bounds: lower and upper corner (3,) of the box around all vertices, mm.
        vertices: (n, 3) float32, mm.
        faces: (m, 3) uint32, indices of vertices.
        scene: Mitsuba's scene of the merged mesh, or of several scenes (`share_scene`).
        offset: vector (mm) from the mesh to its place in ``scene``; None for no offset.
        reach: length (mm) of rays in a scene with an offset.
        rows: (4 m,) four floats per face: the normal, and as bits the surface's number (with
            ``SMOOTH_FACE`` set where the shading normal varies).
        corners: (12 m,) twelve floats per face: three corner normals, padded to four floats.
        table: (16 n,) the optical data of the surfaces (`surface_table`).
        smooth: whether any face has interpolated normals.
        rough: whether any interface scatters light.
        absorbing: whether any medium absorbs light.
        dispersive: whether any refractive index differs between channels.
    """

    def __init__(
        self,
        pieces: list[Piece],
        numbers: list[int] | None = None,
        table: mi.Float | None = None,
        robust: bool = False,
    ) -> None:
        """Build the mesh and its acceleration structure.

        Args:
            numbers: the number in ``table`` of each piece's surface; in the order of the pieces if
                None.
            table: the table of surfaces (see ``surface_table``) that several scenes of one sensor
                share; built from the pieces if None.
            robust: whether no ray may pass between two adjacent triangles, which takes a little
                longer.
        """
        self.pieces = pieces
        surfaces = [piece.surface for piece in pieces]
        numbers = list(range(len(pieces))) if numbers is None else numbers
        vertices, faces, rows, corners = _merge(pieces, numbers)
        self.bounds = vertices.min(axis=0), vertices.max(axis=0)
        self.vertices = vertices
        self.faces = faces
        self.scene = mi.load_dict(
            {
                "type": "scene",
                "sensor": _mesh(vertices, faces),
                "embree_use_robust_intersections": robust,
            }
        )
        self.offset: mi.Vector3f | None = None
        self.reach = mi.Float(dr.inf)
        self.rows = floats(rows)
        self.corners = floats(corners)
        self.table = surface_table(surfaces) if table is None else table
        self.smooth = any(piece.normals is not None for piece in pieces)
        self.rough = any(
            s.kind is SurfaceKind.DIELECTRIC and s.alpha > SMOOTH_ALPHA for s in surfaces
        )
        self.absorbing = any(surface.absorbs for surface in surfaces)
        self.dispersive = any(surface.etas is not None for surface in surfaces)

    @property
    def channels(self) -> tuple[int | None, ...]:
        """The channels that need separate rays; None for those that share their rays."""
        return (0, 1, 2) if self.dispersive else (None,)

    @cached_property
    def patches(self) -> mi.UInt32:
        """The number (m,) of the smooth patch that each triangle belongs to (see `Piece`)."""
        numbers, start = [], 0
        for piece in self.pieces:
            numbers.append(piece.patches + start)
            start += int(piece.patches.max(initial=-1)) + 1
        return indices(np.concatenate(numbers))

    def with_table(self, table: mi.Float) -> RayScene:
        """Return a scene of the same triangles with another `surface_table` (16 n,)."""
        other = copy(self)
        other.table = table
        return other

    def occluded(self, origin: mi.Point3f, direction: mi.Vector3f, active: mi.Bool) -> mi.Bool:
        """Return a mask of the active rays that hit a surface; symbolic loops may call it."""
        ray = self._displaced(origin, direction)
        return self.scene.ray_test(ray, coherent=False, active=active)

    def hit_distance(self, origin: mi.Point3f, direction: mi.Vector3f) -> tuple[mi.Float, mi.Bool]:
        """Return the distances (mm) of the first hits along rays, and a mask of the rays that hit a
        surface; symbolic loops may call it.
        """
        found = self.scene.ray_intersect_preliminary(
            self._displaced(origin, direction), coherent=False, active=mi.Bool(True)
        )
        return found.t, found.is_valid()

    def intersect(self, ray: Ray) -> SurfaceHit:
        """Return the first hits along rays, with normals; symbolic loops may call it."""
        origin, direction = ray.origin, ray.direction
        found = self.scene.ray_intersect_preliminary(
            self._displaced(origin, direction), coherent=False, active=ray.active
        )
        valid = ray.active & found.is_valid()
        face = found.prim_index
        row = dr.gather(mi.Vector4f, self.rows, face, valid)
        normal = mi.Vector3f(row.x, row.y, row.z)
        bits = dr.reinterpret_array(mi.UInt32, row.w)
        smooth = valid & ((bits & SMOOTH_FACE) != 0)
        u, v = found.prim_uv.x, found.prim_uv.y
        corners = [dr.gather(mi.Vector4f, self.corners, face * 3 + k, smooth) for k in range(3)]
        blended = corners[0] * (1 - u - v) + corners[1] * u + corners[2] * v
        blended = dr.normalize(mi.Vector3f(blended.x, blended.y, blended.z))
        return SurfaceHit(
            valid=valid,
            distance=found.t,
            point=mi.Point3f(origin + direction * found.t),
            normal=normal,
            shading_normal=dr.select(smooth, blended, normal),
            surface=bits & (SMOOTH_FACE - 1),
            face=face,
        )

    def _displaced(self, origin: mi.Point3f, direction: mi.Vector3f) -> mi.Ray3f:
        """Return Mitsuba's rays in ``scene``."""
        if self.offset is None:
            return mi.Ray3f(origin, direction)
        return mi.Ray3f(origin + self.offset, direction, self.reach, 0.0, [])


def share_scene(scenes: Sequence[RayScene]) -> list[RayScene]:
    """Return the same ray scenes, whose meshes are all in a single scene of Mitsuba.

    OptiX can trace rays in only one scene within a kernel, whereas Embree has no such limit. Each
    mesh is therefore displaced to a place of its own along the x axis, and its rays begin there and
    end before they reach another mesh.

    Args:
        scenes: ray scenes of one sensor.
    """
    lower = np.min([scene.bounds[0] for scene in scenes], axis=0)
    upper = np.max([scene.bounds[1] for scene in scenes], axis=0)
    diagonal = float(np.linalg.norm(upper - lower))
    reach = LONGEST_RAY * diagonal
    # Sums with a power of two round the least.
    spacing = 2.0 ** math.ceil(math.log2(reach + diagonal))
    offsets = [spacing * (i - len(scenes) // 2) for i in range(len(scenes))]
    meshes = {
        f"mesh_{i}": _mesh(scene.vertices + np.array([offset, 0, 0], np.float32), scene.faces)
        for i, (scene, offset) in enumerate(zip(scenes, offsets, strict=True))
    }
    together = mi.load_dict({"type": "scene", **meshes})
    shared = []
    for scene, offset in zip(scenes, offsets, strict=True):
        other = copy(scene)
        other.scene = together
        # Opaque values, as constants would give each sensor kernels of its own.
        other.offset = mi.Vector3f(dr.opaque(mi.Float, offset), 0, 0)
        other.reach = dr.opaque(mi.Float, reach)
        shared.append(other)
    return shared


def _mesh(vertices: NDArray[np.float32], faces: NDArray[np.integer]) -> mi.Mesh:
    """Return Mitsuba's mesh of vertices (n, 3), mm, and faces (m, 3)."""
    mesh = mi.Mesh("sensor", len(vertices), len(faces))
    params = mi.traverse(mesh)
    params["vertex_positions"] = mi.Float(vertices.ravel())
    params["faces"] = mi.UInt32(faces.ravel())
    params.update()
    return mesh


def leave(point: mi.Point3f, normal: mi.Vector3f, direction: mi.Vector3f) -> mi.Point3f:
    """Return the origin of a ray `RAY_OFFSET` off a surface, on the side of ``direction``."""
    side = dr.select(dr.dot(direction, normal) > 0, RAY_OFFSET, -RAY_OFFSET)
    return mi.Point3f(point + normal * side)


def _merge(
    pieces: list[Piece], numbers: list[int]
) -> tuple[FloatingArray, NDArray[np.uint32], NDArray[np.float32], NDArray[np.float32]]:
    vertices, faces, rows = [], [], []
    start = 0
    for number, piece in zip(numbers, pieces, strict=True):
        bits = number if piece.normals is None else number | SMOOTH_FACE
        row = piece.rows.copy()
        row[:, 3] = np.array([bits], dtype=np.uint32).view(np.float32)
        vertices.append(np.asarray(piece.vertices, dtype=np.float32))
        faces.append(np.asarray(piece.faces, dtype=np.uint32) + np.uint32(start))
        rows.append(row)
        start += len(piece.vertices)
    corners = [piece.corners for piece in pieces]
    return (
        np.concatenate(vertices),
        np.concatenate(faces),
        np.concatenate(rows),
        np.concatenate(corners),
    )
