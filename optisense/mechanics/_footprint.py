"""The footprint of a contact: the overlap of indenter and skin at rest on a tangent grid."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from optisense.array_types import FloatArray
from optisense.errors import ContactError
from optisense.geometry import TriangleMesh
from optisense.geometry.surface import SurfacePoint
from optisense.mechanics._height_map import heights

MARGIN = 1.15
"""Ratio of the sides of a grid to those of the overlap of the undeformed shapes. The contact area
of a convex indenter lies inside the overlap, except on thin gels that bulge by some per cent."""
POINTS_ACROSS = 64
"""Number of grid points across the shorter side of a contact. The error of a ball's force is then
0.1 %, and that of its contact radius 0.2 %."""
FINEST_PITCH = 0.01
"""Smallest distance (mm) of grid points: a tenth of the finest textures that cameras resolve."""
COARSEST_PITCH = 0.1
"""Largest distance (mm) of grid points: one and a half pixels of a usual picture, so that the
squares of the grid are not visible at rims of wide contacts."""
MAX_POINTS = 480
"""Largest number of grid points along a side; an iteration then takes about 40 ms."""
NO_OVERLAP = -1e3
"""Value of the overlap (mm) without skin or indenter: a gap that no displacement closes."""
PITCHES_PER_OCTAVE = 8
"""Number of grid pitches per factor of two. With few pitches and sizes of grids, presses of similar
depths share kernels, and a press takes half the time."""
POINTS_STEP = 4
"""Step in which the number of grid points along a side grows, and the smallest number, with which
an overlap finer than the grid still has a point on each side."""
SEARCH_POINTS = 96
"""Number of grid points along a side of the first grid, which finds the extent of the overlap."""


class NoFootprintError(ContactError):
    """An indenter overlaps the skin nowhere, or at no point of the grid of its contact."""


@dataclass(frozen=True, eq=False)
class Footprint:
    """The overlap of an indenter and the undeformed skin on a regular grid of their tangent plane.

    Attributes:
        origin: (3,) place of the contact in the design's frame, mm.
        axes: (3, 3): columns are x and y along the skin and z out of the sensor.
        x, y: (columns,) and (rows,) grid coordinates in this frame, mm.
        overlap: (rows, columns) overlap along z (mm), negative where there is a gap; `NO_OVERLAP`
            where there is no skin or no indenter.
        thickness: thickness (mm) of the gel under the contact, or of the flat layer to which the
            gel is compared.
    """

    origin: FloatArray
    axes: FloatArray
    x: FloatArray
    y: FloatArray
    overlap: FloatArray
    thickness: float

    @property
    def pitch(self) -> float:
        """Distance (mm) between neighbouring points."""
        return float(self.x[1] - self.x[0])

    def local(self, points: FloatArray) -> FloatArray:
        """Return points (n, 3), mm, of the design's frame in this frame."""
        # `einsum` rather than `@`, whose threads cost more than they save for three columns.
        return np.einsum("ni,ij->nj", points - self.origin, self.axes)


def footprint(
    indenter: TriangleMesh,
    skin: TriangleMesh,
    spot: SurfacePoint,
    thickness: float,
    points_across: int = POINTS_ACROSS,
) -> Footprint:
    """Return the overlap of a placed indenter with the skin.

    Args:
        indenter: the placed mesh of the indenter in the design's frame (mm), with shading normals
            if its exact shape is smooth.
        skin: the undeformed sensing surface, in the same frame.
        spot: the place of the contact on the skin.
        thickness: thickness of the gel there, mm.
        points_across: number of grid points across the shorter side of the overlap, within the
            bounds on their distance (`FINEST_PITCH`, `COARSEST_PITCH`).

    Raises:
        NoFootprintError: indenter and skin do not overlap, or between the points of the grid only.
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
        raise NoFootprintError(
            "an indenter does not reach the sensing surface",
            where="at ({:.2f}, {:.2f}, {:.2f}) mm".format(*spot.point),
            hint="Press deeper, or check the indenter's shape: it may have a hole there",
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
    overlap = _overlap(body, plane, x, y)
    if not (overlap > 0.0).any():
        (left, right), (front, back) = spans
        raise NoFootprintError(
            f"an indenter meets the skin on {right - left:.2g} x {back - front:.2g} mm only, less "
            f"than the model of the gel resolves, whose points are {pitch:.2g} mm apart there",
            where="at ({:.2f}, {:.2f}, {:.2f}) mm".format(*spot.point),
            hint="Check the unit: lengths of indenters and depths are in mm, so a ball with a "
            "radius of 1.5 mm is sphere:1.5",
        )
    return Footprint(spot.point, axes, x, y, overlap, thickness)


def _step_below(pitch: float) -> float:
    """Round a pitch (mm) down to the geometric series of `PITCHES_PER_OCTAVE`."""
    step = math.floor(PITCHES_PER_OCTAVE * math.log2(pitch / FINEST_PITCH) + 1e-9)
    return float(FINEST_PITCH * 2.0 ** (step / PITCHES_PER_OCTAVE))


def _overlap(body: TriangleMesh, skin: TriangleMesh, x: FloatArray, y: FloatArray) -> FloatArray:
    depth = heights(outer_faces(skin, x, y), x, y, highest=True) - heights(body, x, y)
    return np.where(np.isfinite(depth), depth, NO_OVERLAP)


def outer_faces(skin: TriangleMesh, x: FloatArray, y: FloatArray) -> TriangleMesh:
    """Return the faces of a skin that face outward and lie in the rectangle of a grid.

    Args:
        skin: a skin in the frame of a contact, mm.
        x, y: (columns,) and (rows,) coordinates of the grid, mm.
    """
    low, high = skin.face_bounds
    near = (high[:, 0] >= x[0]) & (low[:, 0] <= x[-1]) & (high[:, 1] >= y[0]) & (low[:, 1] <= y[-1])
    near &= skin.face_normals[:, 2] < 0.0  # face normals of sensing surfaces point into the gel
    return TriangleMesh(skin.vertices, skin.faces[near], skin.normals)


def _tangent_axes(inward: FloatArray) -> FloatArray:
    """Return right-handed axes (3, 3) as columns: z points outward, x is close to the design's."""
    z = -inward
    x = np.eye(3)[int(np.argmin(np.abs(z)))]
    x = x - (x @ z) * z
    x = x / np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])
