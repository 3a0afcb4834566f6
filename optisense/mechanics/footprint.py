"""Where a contact meets the skin: a grid on its tangent plane, and how far both overlap there."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from optisense.errors import ContactError
from optisense.geometry import TriangleMesh
from optisense.geometry.surface import SurfacePoint
from optisense.mechanics.height_map import heights

FloatArray = NDArray[np.float64]

MARGIN = 1.15
"""Sides of a grid over those of the overlap of the undeformed shapes. The true contact of a convex
indenter lies inside of it, but for thin gels that bulge."""
POINTS_ACROSS = 64
"""Grid points across the shorter side of a contact. The force of a ball is then right to 0.1 %, its
contact radius to 0.2 %."""
FINEST_PITCH = 0.01
"""mm; least distance of grid points: a tenth of the finest textures that cameras resolve."""
COARSEST_PITCH = 0.1
"""mm; greatest distance of grid points: one and a half pixels of a usual picture, so that rims of
wide contacts are not seen to be made of squares."""
MAX_POINTS = 480
"""Most grid points along a side; an iteration takes about 40 ms then."""
NO_OVERLAP = -1e3
"""mm; the overlap where there is no skin or no indenter: a gap that nothing closes."""
DOES_NOT_REACH = "an indenter does not reach the sensing surface"
"""What is said where nothing overlaps."""
PITCHES_PER_OCTAVE = 8
"""Pitches between one and its double. With few pitches and sizes of grids, presses of other depths
find their kernels made; a press then takes half the time."""
POINTS_STEP = 4
"""Step in which the number of grid points along a side grows; the least number, too: an overlap
finer than the grid still has a point to each side."""
SEARCH_POINTS = 96
"""Grid points along a side when the extent of the overlap is looked for."""


@dataclass(frozen=True, eq=False)
class Footprint:
    """The overlap of an indenter and the undeformed skin on a regular grid of their tangent plane.

    Attributes:
        origin: (3,) mm, in the design's frame; where the contact sits.
        axes: (3, 3): columns are x and y along the skin and z out of the sensor.
        x, y: (columns,) and (rows,) mm, in this frame.
        overlap: (rows, columns) mm along z, negative where there is a gap; `NO_OVERLAP` where there
            is no skin or no indenter.
        thickness: mm, of the gel under the contact.
    """

    origin: FloatArray
    axes: FloatArray
    x: FloatArray
    y: FloatArray
    overlap: FloatArray
    thickness: float

    @property
    def pitch(self) -> float:
        """mm between neighbouring points."""
        return float(self.x[1] - self.x[0])

    def local(self, points: FloatArray) -> FloatArray:
        """(n, 3) points of the design's frame in this frame."""
        return (points - self.origin) @ self.axes


def footprint(
    indenter: TriangleMesh,
    skin: TriangleMesh,
    spot: SurfacePoint,
    thickness: float,
    points_across: int = POINTS_ACROSS,
) -> Footprint:
    """The overlap of a placed indenter with the skin.

    Args:
        indenter: where it is pressed in, in the design's frame, with shading normals if its exact
            shape is smooth.
        skin: the undeformed sensing surface, in the same frame.
        spot: where the contact sits.
        thickness: mm, of the gel there.
        points_across: grid points across the shorter side of the overlap, where neither of the
            bounds on their distance holds.

    Raises:
        ContactError: they do not overlap.
    """
    axes = _tangent_axes(spot.inward)
    pose = np.eye(4)
    pose[:3, :3] = axes.T
    pose[:3, 3] = -axes.T @ spot.point
    body, plane = indenter.transformed(pose), skin.vertex_normals().transformed(pose)
    low, high = body.bounds[:, :2]
    x, y = (np.linspace(a, b, SEARCH_POINTS) for a, b in zip(low, high, strict=True))
    rough = _overlap(body, plane, x, y)
    inside = rough > 0.0
    if not inside.any():
        raise ContactError(
            DOES_NOT_REACH,
            where="at ({:.2f}, {:.2f}, {:.2f}) mm".format(*spot.point),
            hint="press deeper, or check the indenter's shape",
        )
    columns, rows = np.flatnonzero(inside.any(axis=0)), np.flatnonzero(inside.any(axis=1))
    spans = [
        (grid[max(some[0] - 1, 0)], grid[min(some[-1] + 1, len(grid) - 1)])
        for grid, some in ((x, columns), (y, rows))
    ]
    sizes = [MARGIN * (b - a) for a, b in spans]
    pitch = min(min(sizes) / points_across, COARSEST_PITCH)
    pitch = _step_below(max(pitch, max(sizes) / MAX_POINTS, FINEST_PITCH))
    x, y = (
        (a + b) / 2 + pitch * (np.arange(n) - (n - 1) / 2)
        for (a, b), n in (
            (span, POINTS_STEP * max(math.ceil(size / pitch / POINTS_STEP), 1))
            for span, size in zip(spans, sizes, strict=True)
        )
    )
    return Footprint(spot.point, axes, x, y, _overlap(body, plane, x, y), thickness)


def _step_below(pitch: float) -> float:
    """The nearest pitch (mm) on the ladder of `PITCHES_PER_OCTAVE` that is not greater."""
    step = math.floor(PITCHES_PER_OCTAVE * math.log2(pitch / FINEST_PITCH) + 1e-9)
    return float(FINEST_PITCH * 2.0 ** (step / PITCHES_PER_OCTAVE))


def _overlap(body: TriangleMesh, skin: TriangleMesh, x: FloatArray, y: FloatArray) -> FloatArray:
    depth = heights(outer_faces(skin, x, y), x, y, highest=True) - heights(body, x, y)
    return np.where(np.isfinite(depth), depth, NO_OVERLAP)


def outer_faces(skin: TriangleMesh, x: FloatArray, y: FloatArray) -> TriangleMesh:
    """The faces of a skin that look outward and lie in the rectangle of a grid."""
    low, high = skin.triangles.min(axis=1), skin.triangles.max(axis=1)
    near = (high[:, 0] >= x[0]) & (low[:, 0] <= x[-1]) & (high[:, 1] >= y[0]) & (low[:, 1] <= y[-1])
    near &= skin.face_normals[:, 2] < 0.0  # sensing surfaces are wound to look into the gel
    return TriangleMesh(skin.vertices, skin.faces[near], skin.normals)


def _tangent_axes(inward: FloatArray) -> FloatArray:
    """(3, 3): columns x, y, z, right-handed; z is outward, and x lies near the frame's x axis."""
    z = -inward
    x = np.eye(3)[int(np.argmin(np.abs(z)))]
    x = x - (x @ z) * z
    x = x / np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])
