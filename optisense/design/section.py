"""Section through a design: the outlines of its parts in a plane through the camera."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from optisense.array_types import FloatArray
from optisense.design.parts import Role
from optisense.design.projection import directions
from optisense.geometry import TriangleMesh
from optisense.geometry.connected import chains

if TYPE_CHECKING:
    from optisense.design.sensor_design import SensorDesign

OFF_VERTICES = 1e-7
"""Height, mm, over the plane that is assumed for vertices in it, so that no vertex is on it."""


class Outline(NamedTuple):
    """Intersection of a part with the plane.

    Attributes:
        name: name of the part.
        role: role of the part.
        lines: polylines (n, 2), mm; those of a solid are closed: the first point is repeated.
    """

    name: str
    role: Role
    lines: list[FloatArray]


@dataclass(frozen=True)
class Section:
    """Section of a design by a plane through the camera.

    Coordinates in the plane are across the view and along it, mm.

    Attributes:
        outlines: outlines of the parts that the plane meets, in the design's order.
        missed: names of the parts that it does not meet.
        lights: positions (k, 2) of each light group, projected onto the plane.
        colours: colours of the light groups, channels 0..1.
        camera: position (2,) of the pupil.
        half_angle: angle between the view and its border in the plane, degrees.
        across, along: unit vectors (3,) of the plane in the design's frame.
    """

    outlines: list[Outline]
    missed: list[str]
    lights: dict[str, FloatArray]
    colours: dict[str, tuple[float, float, float]]
    camera: FloatArray
    half_angle: float
    across: FloatArray
    along: FloatArray

    @property
    def bounds(self) -> FloatArray:
        """Lowest and highest coordinates of parts, lights and camera, (2, 2) mm."""
        points = [line for outline in self.outlines for line in outline.lines]
        points += [*self.lights.values(), self.camera[None]]
        every = np.concatenate(points)
        return np.array([every.min(axis=0), every.max(axis=0)])


def section(design: SensorDesign) -> Section:
    """Cut a design by the plane through the camera's axis that shows more of the sensing surface.

    The plane contains the viewing direction, and image right or image up: the one along which the
    sensing surface is longer.
    """
    camera = design.camera
    right, up, forward = camera.axes()
    origin = np.asarray(camera.position, dtype=np.float64)
    meshes = design.deformed_meshes()
    is_wide = along_rows(design)
    across = right if is_wide else up
    normal = np.cross(across, forward)
    ends = np.array([0.0, 1.0]), np.array([0.5, 0.5])
    rays = directions(camera, *(ends if is_wide else ends[::-1]))
    half_angle = np.arccos(np.clip(rays @ forward, -1.0, 1.0)).mean()

    def flat(places: FloatArray) -> FloatArray:
        return np.stack([places @ across, places @ forward], axis=-1)

    outlines, missed = [], []
    for name, mesh in meshes.items():
        lines = [flat(line) for line in cut(mesh, origin, normal)]
        if lines:
            outlines.append(Outline(name, design.parts[name].role, lines))
        else:
            missed.append(name)
    lights = {
        name: flat(np.array([light.position for light in group.lights], dtype=np.float64))
        for name, group in design.lights.items()
        if group.lights
    }
    return Section(
        outlines=outlines,
        missed=missed,
        lights=lights,
        colours={name: design.lights[name].colour for name in lights},
        camera=flat(origin),
        half_angle=float(np.degrees(half_angle)),
        across=across,
        along=forward,
    )


def along_rows(design: SensorDesign) -> bool:
    """Return whether the section runs along the rows of the picture, else along its columns."""
    right, up, _ = design.camera.axes()
    meshes = design.deformed_meshes()
    sensed = [meshes[name].vertices for name in design.parts_of(Role.SENSING_SURFACE)]
    points = np.concatenate(sensed) if sensed else design.bounds()
    return bool(np.ptp(points @ right) >= np.ptp(points @ up))


def cut(mesh: TriangleMesh, origin: FloatArray, normal: FloatArray) -> list[FloatArray]:
    """Return the intersection of an open or closed mesh with the plane of a point (3,), mm, and a
    normal (3,): polylines (n, 3), mm, of which closed ones repeat their first point at the end.
    """
    welded = mesh.welded()
    height = (welded.vertices - origin) @ normal
    height = np.where(np.abs(height) < OFF_VERTICES, OFF_VERTICES, height)
    faces = welded.faces.astype(np.int64)
    above = height[faces] > 0
    crossed = np.flatnonzero(above.any(axis=1) & ~above.all(axis=1))
    edges = faces[crossed][:, [[0, 1], [1, 2], [2, 0]]]
    splits = above[crossed] != np.roll(above[crossed], -1, axis=1)
    pairs = np.sort(edges[splits].reshape(-1, 2, 2), axis=2)  # the two crossed edges of each face
    if not len(pairs):
        return []
    unique, numbers = np.unique(pairs.reshape(-1, 2), axis=0, return_inverse=True)
    a, b = unique.T
    share = (height[a] / (height[a] - height[b]))[:, None]
    points = welded.vertices[a] + share * (welded.vertices[b] - welded.vertices[a])
    return [points[chain] for chain in chains(numbers.reshape(-1, 2))]
