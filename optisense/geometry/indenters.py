"""What presses on a sensor: spheres, cylinders, plates and any mesh.

Each indenter has a frame of its own: +z points away from the sensor, and its lowest point lies
at z = 0. Shading normals are those of the exact shape and point out of the indenter.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

from optisense.errors import ContactError
from optisense.geometry.mesh import TriangleMesh, grid_faces

FACET_ERROR = 4e-4
"""Facets stay this close (mm) to the exact shape: well below what a camera resolves."""


class Indenter(Protocol):
    """Anything that can be pressed into a sensor.

    One that can't shade itself, being convex, may say so by an attribute ``convex = True``: its
    images then take fewer shadow rays.
    """

    def mesh(self, reach: float, facet_error: float = FACET_ERROR) -> TriangleMesh:
        """The surface from its lowest point up to height `reach` (mm), or more of it.

        Args:
            reach: mm; what lies higher can't touch the sensor and may be left out.
            facet_error: mm, largest distance of the facets from the exact shape.

        Returns:
            A mesh with outward shading normals in the indenter's frame.
        """
        ...


def _positive(name: str, value: float) -> None:
    if not (math.isfinite(value) and value > 0.0):
        raise ContactError(
            f"the {name} of an indenter is {value:g}", hint="give a length above 0, in mm"
        )


@dataclass(frozen=True)
class Sphere:
    """A ball.

    Attributes:
        radius: mm.
    """

    radius: float

    convex: ClassVar[bool] = True

    def __post_init__(self) -> None:
        _positive("radius", self.radius)

    def mesh(self, reach: float, facet_error: float = FACET_ERROR) -> TriangleMesh:
        """See `Indenter.mesh`: a cap, cut along parallels and meridians."""
        end = _arc(self.radius, reach)
        rings, sectors = self._divisions(end, facet_error)
        polar = np.linspace(0.0, end, rings + 1)
        around = np.linspace(0.0, 2.0 * np.pi, sectors + 1)
        t, a = np.meshgrid(polar, around, indexing="ij")
        normals = np.stack([np.sin(t) * np.cos(a), np.sin(t) * np.sin(a), -np.cos(t)], axis=-1)
        normals = normals.reshape(-1, 3)
        faces = grid_faces(rings + 1, sectors + 1)
        vertices = self.radius * (normals + [0.0, 0.0, 1.0])
        corners = vertices[faces]
        size = np.linalg.norm(
            np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
        )
        return TriangleMesh(vertices, faces[size > 1e-12], normals).wound_like_normals()

    def _divisions(self, end: float, facet_error: float) -> tuple[int, int]:
        """Square cells at the widest parallel, with both triangles within the error.

        A flat triangle of circumradius c lies c^2 / (2 R) below a sphere of radius R at most;
        a square cell of side s has c = s / sqrt(2).
        """
        side = math.sqrt(4.0 * self.radius * min(facet_error, 0.1 * self.radius))
        widest = self.radius * math.sin(min(end, math.pi / 2))
        rings = max(2, math.ceil(self.radius * end / side))
        return rings, max(12, math.ceil(2.0 * math.pi * widest / side))


@dataclass(frozen=True)
class Cylinder:
    """A cylinder that lies on its side, with flat ends.

    Attributes:
        radius: mm.
        length: mm, along its axis.
        angle: degrees from the u axis of the sensing surface to the cylinder's axis.
    """

    radius: float
    length: float = 40.0
    angle: float = 0.0

    convex: ClassVar[bool] = True

    def __post_init__(self) -> None:
        _positive("radius", self.radius)
        _positive("length", self.length)

    def mesh(self, reach: float, facet_error: float = FACET_ERROR) -> TriangleMesh:
        """See `Indenter.mesh`: the lower part of the side and of both ends."""
        end = _arc(self.radius, reach)
        step = 2.0 * math.acos(1.0 - min(facet_error / self.radius, 0.1))
        count = 2 * max(2, math.ceil(end / step))  # even: the lowest line is a vertex line
        around = np.linspace(-end, end, count + 1)
        profile = np.column_stack([np.zeros(count + 1), np.sin(around), -np.cos(around)])
        half = np.array([0.5 * self.length, 0.0, 0.0])
        rise = np.array([0.0, 0.0, self.radius])
        rim = self.radius * profile + rise
        side = TriangleMesh(
            np.concatenate([rim - half, rim + half]),
            grid_faces(2, count + 1),
            np.concatenate([profile, profile]),
        ).wound_like_normals()
        ends = []
        for sign in (-1.0, 1.0):
            middle = np.array([0.0, 0.0, rim[[0, -1], 2].mean()])
            vertices = np.concatenate([rim, [middle]]) + sign * half
            fan = np.column_stack(
                [np.arange(count), np.arange(1, count + 1), np.full(count, count + 1)]
            )
            normals = np.tile([sign, 0.0, 0.0], (len(vertices), 1))
            ends.append(TriangleMesh(vertices, fan, normals).wound_like_normals())
        return TriangleMesh.joined([side, *ends]).transformed(_turn_z(self.angle))


@dataclass(frozen=True)
class Plane:
    """A square plate, pressed flat or tilted.

    Its middle lies above the contact place; the depth counts to its lowest corner.

    Attributes:
        tilt_x, tilt_y: degrees, turned about the u axis and then about the v axis.
        size: mm, its side.
    """

    tilt_x: float = 0.0
    tilt_y: float = 0.0
    size: float = 8.0

    convex: ClassVar[bool] = True

    def __post_init__(self) -> None:
        _positive("size", self.size)
        if not (abs(self.tilt_x) < 90.0 and abs(self.tilt_y) < 90.0):
            raise ContactError(
                f"a plate is tilted by {self.tilt_x:g} and {self.tilt_y:g} degrees",
                hint="keep both tilts between -90 and 90 degrees",
            )

    def mesh(self, reach: float, facet_error: float = FACET_ERROR) -> TriangleMesh:
        """See `Indenter.mesh`: the whole plate, as thick as it is wide."""
        half = 0.5 * self.size
        block = TriangleMesh.box((-half, -half, 0.0), (half, half, self.size)).vertex_normals()
        x, y = math.radians(self.tilt_x), math.radians(self.tilt_y)
        about_x = [[1, 0, 0], [0, math.cos(x), -math.sin(x)], [0, math.sin(x), math.cos(x)]]
        about_y = [[math.cos(y), 0, math.sin(y)], [0, 1, 0], [-math.sin(y), 0, math.cos(y)]]
        return _lowest_at_zero(block.transformed(np.array(about_y) @ np.array(about_x)))


@dataclass(frozen=True)
class MeshIndenter:
    """Any shape: +z of its mesh points away from the sensor.

    Its lowest point (the middle of them, where there are several) is put on the contact place.

    Attributes:
        source: a mesh (mm), or an OBJ, STL or PLY file.
        scale: factor from the mesh's unit to mm.
    """

    source: TriangleMesh | str | Path
    scale: float = 1.0

    def __post_init__(self) -> None:
        _positive("scale", self.scale)

    @cached_property
    def _whole(self) -> TriangleMesh:
        source = self.source
        name = "indenter" if isinstance(source, TriangleMesh) else Path(source).name
        mesh = source if isinstance(source, TriangleMesh) else TriangleMesh.load(source)
        mesh = mesh.validate(name, closed=False)
        if mesh.normals is None:
            mesh = mesh.welded().vertex_normals()
        mesh = _lowest_at_zero(mesh.transformed(np.eye(3) * self.scale))
        size = np.ptp(mesh.bounds, axis=0).max()
        lowest = mesh.vertices[mesh.vertices[:, 2] <= 1e-6 * size]
        x, y = 0.5 * (lowest.min(axis=0) + lowest.max(axis=0))[:2]
        return _moved(mesh, (-x, -y, 0.0))

    def mesh(self, reach: float, facet_error: float = FACET_ERROR) -> TriangleMesh:
        """See `Indenter.mesh`: all of it, in its own triangles."""
        return self._whole


def _arc(radius: float, reach: float) -> float:
    """The angle (radians) from the lowest point of a circle to height `reach`."""
    return math.acos(max(-1.0, 1.0 - reach / radius))


def _turn_z(angle: float) -> NDArray[np.float64]:
    """(3, 3): by `angle` degrees about z."""
    a = math.radians(angle)
    return np.array([[math.cos(a), -math.sin(a), 0], [math.sin(a), math.cos(a), 0], [0, 0, 1]])


def _moved(mesh: TriangleMesh, shift: tuple[float, float, float]) -> TriangleMesh:
    return TriangleMesh(mesh.vertices + shift, mesh.faces, mesh.normals)


def _lowest_at_zero(mesh: TriangleMesh) -> TriangleMesh:
    return _moved(mesh, (0.0, 0.0, -float(mesh.bounds[0, 2])))
