"""Reliefs: heights over a plane, converted to a closed mesh on a base plate."""

from __future__ import annotations

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
