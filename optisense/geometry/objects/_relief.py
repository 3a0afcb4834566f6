"""Reliefs, which are heights over a plane, as closed meshes; and figures to build heights from.

Figures are given by signed distances (mm), negative inside. Coordinates ``x``, ``y``, distances and
heights are arrays of any one shape (...), in mm.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from optisense.array_types import FloatArray
from optisense.geometry.mesh import TriangleMesh, grid_faces

Heights = Callable[[FloatArray, FloatArray], FloatArray]

CELLS = 200
"""Number of cells of the grid along an object's longer side: 0.04 mm on an object of 8 mm, smaller
than the pixel of any built-in sensor."""

EDGE = 0.8
"""Standard deviation, in cells of the grid, of the Gaussian that rounds edges to a radius of about
0.05 mm, that of deburred metal and moulded plastic."""

TOP = 2.0
"""Height (mm) above the lowest point at which the base plate begins, which no contact reaches."""

PLATE = 1.0
"""Thickness (mm) of the base plate, which closes the mesh and is never seen."""

BORDER = 0.6
"""Width (mm) by which the base plate extends beyond the object on each side: a steep wall of `TOP`
is 0.35 mm wide."""

STEEP = 5.67
"""Slope of walls, mm of height per mm: the tangent of 80 degrees, the draft of moulded parts."""


@dataclass(frozen=True)
class Relief:
    """An object as heights over a plane.

    Attributes:
        title: display name.
        help: description with its sizes, one sentence.
        size: (x, y) sides of the rectangle around it, mm.
        depth: depth (mm) of a press at which it is recognisable.
        heights: function that returns the height (mm) at places x, y (mm) around the middle; larger
            is farther from the sensor. An added constant has no effect.
    """

    title: str
    help: str
    size: tuple[float, float]
    depth: float
    heights: Heights

    def mesh(self) -> TriangleMesh:
        """Return the object as a closed mesh (mm).

        +z points away from the sensor and the lowest point lies at z = 0. Shading normals point out
        of the object and are those of the heights.
        """
        return _mesh(self)


@lru_cache(maxsize=32)
def _mesh(relief: Relief) -> TriangleMesh:
    from scipy.ndimage import gaussian_filter  # takes a third of a second to load

    half = [0.5 * side + BORDER for side in relief.size]
    pitch = 2.0 * max(half) / CELLS
    x, y = (np.linspace(-each, each, math.ceil(2.0 * each / pitch) + 1) for each in half)
    across, along = np.meshgrid(x, y)
    raw = relief.heights(across, along)
    z = gaussian_filter(np.minimum(raw - raw.min(), TOP), EDGE, mode="nearest")
    z -= z.min()
    rise_y, rise_x = np.gradient(z, y, x)
    normals = np.stack([rise_x, rise_y, -np.ones_like(z)], axis=-1)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    vertices = np.stack([across, along, z], axis=-1)
    face = TriangleMesh(
        vertices.reshape(-1, 3), grid_faces(len(y), len(x)), normals.reshape(-1, 3)
    ).with_winding_from_normals()
    return TriangleMesh.joined([face, *_sides(vertices), _back(vertices)])


def _sides(vertices: FloatArray) -> list[TriangleMesh]:
    """Return the four walls of the base plate, from the border of the heights to the back."""
    rims = (vertices[0], vertices[-1], vertices[:, 0], vertices[:, -1])
    outward = ((0.0, -1.0, 0.0), (0.0, 1.0, 0.0), (-1.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    walls = []
    for rim, normal in zip(rims, outward, strict=True):
        corners = np.concatenate([rim, _lifted(rim)])
        normals = np.tile(normal, (len(corners), 1))
        walls.append(
            TriangleMesh(corners, grid_faces(2, len(rim)), normals).with_winding_from_normals()
        )
    return walls


def _back(vertices: FloatArray) -> TriangleMesh:
    """Return the back of the base plate: a fan whose rim has the corners of the walls."""
    rim = np.concatenate(
        [vertices[0, :-1], vertices[:-1, -1], vertices[-1, :0:-1], vertices[:0:-1, 0]]
    )
    corners = _lifted(np.concatenate([rim, [vertices.reshape(-1, 3).mean(axis=0)]]))
    here = np.arange(len(rim))
    faces = np.column_stack([here, np.roll(here, -1), np.full(len(rim), len(rim))])
    normals = np.tile((0.0, 0.0, 1.0), (len(corners), 1))
    return TriangleMesh(corners, faces, normals).with_winding_from_normals()


def _lifted(points: FloatArray) -> FloatArray:
    lifted = points.copy()
    lifted[:, 2] = TOP + PLATE
    return lifted


def disc(x: FloatArray, y: FloatArray, radius: float) -> FloatArray:
    """Return the distance (...), mm, to a disc of a radius (mm) around the origin."""
    return np.hypot(x, y) - radius


def rectangle(x: FloatArray, y: FloatArray, width: float, height: float) -> FloatArray:
    """Return the distance (...), mm, to a rectangle around the origin, ``width`` along x."""
    over_x, over_y = np.abs(x) - 0.5 * width, np.abs(y) - 0.5 * height
    outside = np.hypot(np.maximum(over_x, 0.0), np.maximum(over_y, 0.0))
    return outside + np.minimum(np.maximum(over_x, over_y), 0.0)


def hexagon(x: FloatArray, y: FloatArray, across_flats: float) -> FloatArray:
    """Return the distance (...), mm, to the sides of a regular hexagon around the origin,
    perpendicular to the nearest side; ``across_flats`` (mm) is the distance of opposite sides.
    """
    turns = np.radians([0.0, 60.0, 120.0])
    sides = [np.abs(x * np.cos(turn) + y * np.sin(turn)) for turn in turns]
    return np.maximum.reduce(sides) - 0.5 * across_flats


def strokes(x: FloatArray, y: FloatArray, lines: list[list[tuple[float, float]]]) -> FloatArray:
    """Return the distance (...), mm, to the nearest of several polylines (lists of points, mm)."""
    nearest = np.full(x.shape, np.inf)
    for line in lines:
        for start, end in itertools.pairwise(line):
            nearest = np.minimum(nearest, _segment(x, y, np.array(start), np.array(end)))
    return nearest


def _segment(x: FloatArray, y: FloatArray, start: FloatArray, end: FloatArray) -> FloatArray:
    way = end - start
    along = ((x - start[0]) * way[0] + (y - start[1]) * way[1]) / (way @ way)
    share = np.clip(along, 0.0, 1.0)
    return np.hypot(x - start[0] - share * way[0], y - start[1] - share * way[1])


def wall(distance: FloatArray) -> FloatArray:
    """Return the height (...), mm, of a steep wall that begins where a distance (...), mm, is 0 and
    rises outside.
    """
    return STEEP * np.maximum(distance, 0.0)


def raised(distance: FloatArray, height: float) -> FloatArray:
    """Return the height (...), mm, to subtract from a ground for a figure that stands out by
    `height` (mm): all of it inside, and less along its steep wall.
    """
    return np.clip(height - wall(distance), 0.0, height)


def dome(distance: FloatArray, radius: float, height: float) -> FloatArray:
    """Return the height (...), mm, to subtract from a ground for a spherical cap of a base radius
    and a height (mm), by the distance (...), mm, from its middle.
    """
    sphere = (radius**2 + height**2) / (2.0 * height)
    top = np.sqrt(np.maximum(sphere**2 - distance**2, 0.0)) - (sphere - height)
    return np.where(distance < radius, top, 0.0)


def star(x: FloatArray, y: FloatArray, points: int, outer: float, inner: float) -> FloatArray:
    """Return the relative depth (...) of places inside a star, from 0 at its outline to 1 in its
    middle.

    Level lines are smaller stars, so that a relief of these heights has plane facets.

    Args:
        x, y: the places, mm.
        points: number of the star's points.
        outer, inner: radii (mm) of its points and of the corners between them.
    """
    sector = np.pi / points
    angle = np.abs(np.mod(np.arctan2(y, x) + sector, 2.0 * sector) - sector)
    tip = np.array([outer, 0.0])
    valley = inner * np.array([np.cos(sector), np.sin(sector)])
    normal: FloatArray = np.array([valley[1] - tip[1], tip[0] - valley[0]])
    radius = np.hypot(x, y)
    along = radius * (np.cos(angle) * normal[0] + np.sin(angle) * normal[1])
    return np.clip(1.0 - along / float(tip @ normal), 0.0, 1.0)
