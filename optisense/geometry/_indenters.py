"""Indenters that press on a sensor: spheres, cylinders, plates and any mesh.

Each indenter has a frame of its own: +z points away from the sensor, and its lowest point lies
at z = 0; `Contact` states how x and y lie on the sensor. Shading normals are those of the exact
shape and point out of the indenter.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from optisense.errors import ContactError
from optisense.geometry.indenter_kinds import (
    ABOVE_ZERO,
    FACET_ERROR,
    LARGEST,
    SMALLEST,
    IndenterKind,
    lowest_at_zero,
    quantity,
)
from optisense.geometry.mesh import TriangleMesh, grid_faces
from optisense.geometry.rotations import turn_about_axes
from optisense.text import brief
from optisense.untrusted_files import Stamp, file_stamp


@dataclass(frozen=True)
class Sphere(IndenterKind):
    """A ball.

    Attributes:
        radius: radius, mm.
    """

    kind: ClassVar[str] = "sphere"
    convex: ClassVar[bool] = True

    radius: float = quantity("mm", "The radius of the ball.", low=SMALLEST, high=LARGEST)

    def tilted(self, tilt_x: float, tilt_y: float) -> Sphere:
        """Return the same ball."""
        return self

    def mesh(self, reach: float, facet_error: float = FACET_ERROR) -> TriangleMesh:
        """Return a cap of parallels, each divided as finely as needed; see `Indenter.mesh`."""
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
        return TriangleMesh(vertices, faces, normals).with_winding_from_normals()

    def _side(self, facet_error: float) -> float:
        """Return the side (mm) of square cells whose two triangles are within the error.

        A flat triangle of circumradius c lies c^2 / (2 R) below a sphere of radius R at most; a
        square cell of side s has c = s / sqrt(2).
        """
        return math.sqrt(4.0 * self.radius * min(facet_error, 0.1 * self.radius))


@dataclass(frozen=True)
class Cylinder(IndenterKind):
    """A cylinder that lies on its side, with flat ends.

    Attributes:
        radius: radius, mm.
        length: length along its axis, mm.
        angle: angle (degrees) from the indenter's x axis to the cylinder's axis, counter-clockwise
            seen from outside the sensor; see `Contact` for the frame.
    """

    kind: ClassVar[str] = "cylinder"
    convex: ClassVar[bool] = True

    radius: float = quantity("mm", "The radius of the cylinder.", low=SMALLEST, high=LARGEST)
    length: float = quantity("mm", "The length along its axis.", 40.0, low=SMALLEST, high=LARGEST)
    angle: float = quantity("degrees", "From x to its axis, seen from outside.", 0.0)

    def mesh(self, reach: float, facet_error: float = FACET_ERROR) -> TriangleMesh:
        """Return the lower part of the side and of both ends; see `Indenter.mesh`."""
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
        ).with_winding_from_normals()
        ends = []
        for sign in (-1.0, 1.0):
            middle = np.array([0.0, 0.0, rim[[0, -1], 2].mean()])
            vertices = np.concatenate([rim, [middle]]) + sign * half
            fan = np.column_stack(
                [np.arange(count), np.arange(1, count + 1), np.full(count, count + 1)]
            )
            normals = np.tile([sign, 0.0, 0.0], (len(vertices), 1))
            ends.append(TriangleMesh(vertices, fan, normals).with_winding_from_normals())
        return TriangleMesh.joined([side, *ends]).transformed(turn_about_axes(0.0, 0.0, self.angle))


@dataclass(frozen=True)
class Plane(IndenterKind):
    """A square plate, pressed flat or tilted.

    Its middle lies above the place of the contact; the depth is that of its lowest corner.

    Attributes:
        tilt_x, tilt_y: right-handed rotation (degrees) about the indenter's x axis and then about
            its y axis; see `Contact` for the frame. A positive `tilt_x` lowers the side of -y into
            the gel, which is that of +v in a direct view; a positive `tilt_y` that of +x, or +u.
        size: side, mm.
    """

    kind: ClassVar[str] = "plane"
    convex: ClassVar[bool] = True

    tilt_x: float = quantity("degrees", "The turn about the x axis.", 0.0, low=-89.9, high=89.9)
    tilt_y: float = quantity("degrees", "The turn about the y axis.", 0.0, low=-89.9, high=89.9)
    size: float = quantity("mm", "The side of the plate.", 8.0, low=SMALLEST, high=LARGEST)

    def tilted(self, tilt_x: float, tilt_y: float) -> Plane:
        """Return the plate with an additional tilt; its middle stays above the contact's place."""
        return replace(self, tilt_x=self.tilt_x + tilt_x, tilt_y=self.tilt_y + tilt_y)

    def mesh(self, reach: float, facet_error: float = FACET_ERROR) -> TriangleMesh:
        """Return the whole plate, as thick as it is wide; see `Indenter.mesh`."""
        half = 0.5 * self.size
        block = TriangleMesh.box((-half, -half, 0.0), (half, half, self.size)).vertex_normals()
        return lowest_at_zero(block.transformed(turn_about_axes(self.tilt_x, self.tilt_y)))


@dataclass(frozen=True)
class MeshIndenter(IndenterKind):
    """An indenter of any shape; +z of its mesh points away from the sensor.

    Its lowest point (the middle of several) is put on the place of the contact. Two indenters of
    the same file are equal only if the file was not written again in between.

    Attributes:
        source: a mesh (mm), or an OBJ, STL or PLY file.
        scale: factor from the mesh's unit to mm.
    """

    kind: ClassVar[str] = "mesh"

    source: TriangleMesh | str | Path
    scale: float = quantity("", "The factor from the file's unit to mm.", 1.0, low=ABOVE_ZERO)
    _stamp: Stamp | None = field(init=False, repr=False, default=None)

    def __post_init__(self) -> None:
        """Keep the state of the file; raise ContactError if the source is neither a mesh nor a
        path, or by the scale.
        """
        super().__post_init__()
        if not isinstance(self.source, TriangleMesh | str | Path):
            raise ContactError(
                f"a MeshIndenter can't be made of {brief(repr(self.source))}",
                hint="Give a file, or TriangleMesh(mesh.vertices, mesh.faces)",
            )
        if not isinstance(self.source, TriangleMesh):
            object.__setattr__(self, "_stamp", file_stamp(Path(self.source)))

    @classmethod
    def from_text(cls, text: str) -> MeshIndenter:
        """Read PATH or PATH,SCALE; the path may contain commas. See `IndenterKind.from_text`."""
        if not text:
            raise ContactError("the indenter names no mesh file", hint="Write mesh:PATH@U,V:DEPTH")
        path, separator, scale = text.rpartition(",")
        if separator and path:
            try:
                return cls(path, float(scale))
            except ValueError:  # the comma belongs to the file name
                pass
        return cls(text)

    @classmethod
    def from_plain(cls, values: Mapping[str, Any]) -> MeshIndenter:
        """Read `file` and optionally `scale`; see `IndenterKind.from_plain`."""
        rest = dict(values)
        file = rest.pop("file", None)
        if not isinstance(file, str):
            raise ContactError(
                "a mesh needs 'file'", hint="Give the path of an OBJ, STL or PLY file"
            )
        for name, value in rest.items():
            if name != "scale" or isinstance(value, bool) or not isinstance(value, int | float):
                raise ContactError(
                    f"a mesh can't take '{name}': {value!r}", hint="Known: file, scale"
                )
        return cls(file, **rest)

    @cached_property
    def _whole(self) -> TriangleMesh:
        source = self.source
        name = "indenter" if isinstance(source, TriangleMesh) else Path(source).name
        mesh = source if isinstance(source, TriangleMesh) else TriangleMesh.load(source)
        mesh = mesh.validate(name, closed=False)
        if mesh.normals is None:
            mesh = mesh.welded().vertex_normals()
        mesh = lowest_at_zero(mesh.transformed(np.eye(3) * self.scale))
        size = np.ptp(mesh.bounds, axis=0).max()
        if not SMALLEST <= size <= LARGEST:
            raise ContactError(
                f"an indenter of the mesh '{name}' is {size:g} mm large",
                hint=f"Scale it to {SMALLEST:g} to {LARGEST:g} mm: mesh:FILE,SCALE",
            )
        lowest = mesh.vertices[mesh.vertices[:, 2] <= 1e-6 * size]
        x, y = 0.5 * (lowest.min(axis=0) + lowest.max(axis=0))[:2]
        return TriangleMesh(mesh.vertices - (x, y, 0.0), mesh.faces, mesh.normals)

    def mesh(self, reach: float, facet_error: float = FACET_ERROR) -> TriangleMesh:
        """Return the whole mesh with its own triangles; see `Indenter.mesh`."""
        return self._whole


def _between_rings(inner: int, outer: int) -> NDArray[np.int64]:
    """Return triangles (n, 3) between two rings of ``inner`` and ``outer`` evenly spaced points.

    The rings begin at the same angle, and their points are numbered consecutively; a ring may be a
    single point. Each edge of one ring is connected to the point of the other that is nearest to
    its middle.
    """
    i, j = np.arange(inner), np.arange(outer)
    # The number of edges of the other ring whose middles lie before that of an edge.
    to_outer = -(-((2 * i + 1) * outer - inner) // (2 * inner))
    to_inner = ((2 * j + 1) * inner - outer) // (2 * outer) + 1
    of_outer = np.column_stack([inner + j, inner + (j + 1) % outer, to_inner % inner])
    of_inner = np.column_stack([i, (i + 1) % inner, inner + to_outer % outer])
    return np.concatenate([of_outer] * (outer > 1) + [of_inner] * (inner > 1))


def _arc(radius: float, reach: float) -> float:
    """Return the angle (radians) from the lowest point of a circle to height `reach`."""
    return math.acos(max(-1.0, 1.0 - reach / radius))
