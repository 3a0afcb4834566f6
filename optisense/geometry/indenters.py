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
        """See `Indenter.mesh`: a cap of parallels, each cut into as many parts as it needs."""
        end = _arc(self.radius, reach)
        side = self._side(facet_error)
        polar = np.linspace(0.0, end, max(3, math.ceil(self.radius * end / side) + 1))
        around = 2.0 * np.pi * self.radius * np.sin(polar) / side
        counts = np.maximum(
            np.ceil(around - 1e-9).astype(int), np.where(np.sin(polar) > 1e-9, 12, 1)
        )
        t = np.repeat(polar, counts)
        starts = np.cumsum(counts) - counts
        a = (
            2.0
            * np.pi
            * (np.arange(len(t)) - np.repeat(starts, counts))
            / np.repeat(counts, counts)
        )
        normals = np.stack([np.sin(t) * np.cos(a), np.sin(t) * np.sin(a), -np.cos(t)], axis=-1)
        faces = np.concatenate(
            [
                _between_rings(int(counts[i]), int(counts[i + 1])) + starts[i]
                for i in range(len(counts) - 1)
            ]
        )
        vertices = self.radius * (normals + [0.0, 0.0, 1.0])
        return TriangleMesh(vertices, faces, normals).wound_like_normals()

    def _side(self, facet_error: float) -> float:
        """The side of square cells, with both triangles within the error.

        A flat triangle of circumradius c lies c^2 / (2 R) below a sphere of radius R at most;
        a square cell of side s has c = s / sqrt(2).
        """
        return math.sqrt(4.0 * self.radius * min(facet_error, 0.1 * self.radius))


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


def _between_rings(inner: int, outer: int) -> NDArray[np.int64]:
    """Triangles (n, 3) between two rings of so many points (one point is a ring, too), evenly
    spaced from the same angle on and numbered one after the other.

    Each edge of one ring goes to the point of the other that its middle is nearest to.
    """
    i, j = np.arange(inner), np.arange(outer)
    # How many edges of the other ring have their middles before an edge's own.
    to_outer = -(-((2 * i + 1) * outer - inner) // (2 * inner))
    to_inner = ((2 * j + 1) * inner - outer) // (2 * outer) + 1
    of_outer = np.column_stack([inner + j, inner + (j + 1) % outer, to_inner % inner])
    of_inner = np.column_stack([i, (i + 1) % inner, inner + to_outer % outer])
    return np.concatenate([of_outer] * (outer > 1) + [of_inner] * (inner > 1))


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
