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
NARROW_SHARE = 0.125
"""Number of grid points across the mean width of an overlap, as a share of the number across a
contact: features of textures and thin rods at an angle to the grid have 8 points across."""
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
"""Number of grid points along a side of the first grid, which covers the indenter."""
FEWEST_STEPS = 12
"""Number of steps of the first grid across an overlap below which its extent is searched again on
a grid of its size: the extent of an overlap that has more is known to a sixth."""
ROUNDING = 1e-6
"""Distance (mm) by which the extent of an overlap exceeds the vertices and edges found in it, so
that it is never a point."""


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
        depth: depth (mm) to which the indenter is pressed in. It differs from the greatest overlap
            if the skin is curved, or if the deepest place of the indenter is between grid points.
        thickness: thickness (mm) of the gel under the contact, or of the flat layer to which the
            gel is compared.
    """

    origin: FloatArray
    axes: FloatArray
    x: FloatArray
    y: FloatArray
    overlap: FloatArray
    depth: float
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
    depth: float,
    thickness: float,
    points_across: int = POINTS_ACROSS,
) -> Footprint:
    """Return the overlap of a placed indenter, with shading normals if its exact shape is smooth,
    and the undeformed sensing surface around a spot of it.

    Points across the shorter side of the overlap are as many as asked for, within the bounds on
    their distance (`FINEST_PITCH`, `COARSEST_PITCH`). Meshes are in the design's frame, mm.

    Raises:
        NoFootprintError: indenter and skin do not overlap, or between the points of the grid only.
    """
    axes = _tangent_axes(spot.inward)
    pose = np.eye(4)
    pose[:3, :3] = axes.T
    pose[:3, 3] = -axes.T @ spot.point
    body, plane = indenter.transformed(pose), skin.vertex_normals().transformed(pose)
    spans = _extent(body, plane)
    if spans is None:
        raise NoFootprintError(
            "an indenter does not reach the sensing surface",
            where="at ({:.2f}, {:.2f}, {:.2f}) mm".format(*spot.point),
            hint="Press deeper, or check the indenter's shape: it may have a hole there",
        )
    sizes = [MARGIN * (b - a) for a, b in spans]
    least = max(max(sizes) / MAX_POINTS, FINEST_PITCH)
    pitch = _step_below(max(min(min(sizes) / points_across, COARSEST_PITCH), least))
    x, y = (_points(span, size, pitch) for span, size in zip(spans, sizes, strict=True))
    overlap = _overlap(body, plane, x, y)
    share = _points_across(overlap) / (NARROW_SHARE * points_across)
    if share < 1.0 and pitch > least:
        pitch = _step_below(max(pitch * share, least))
        x, y = (_points(span, size, pitch) for span, size in zip(spans, sizes, strict=True))
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
    return Footprint(spot.point, axes, x, y, overlap, depth, thickness)


def _extent(body: TriangleMesh, skin: TriangleMesh) -> FloatArray | None:
    """Return the lowest and highest x, and those of y, as (2, 2) array (mm), of the overlap of an
    indenter and a skin in the frame of a contact; None if they do not overlap.

    The overlap is searched on a grid and at the vertices and edges of the indenter, and then again
    on a grid that covers what was found, if that has few points of the first grid.
    """
    first, last = body.bounds[:, :2]
    face_low, face_high = body.face_bounds
    for _ in range(2):
        x, y = (np.linspace(a, b, SEARCH_POINTS) for a, b in zip(first, last, strict=True))
        height = heights(outer_faces(skin, x, y), x, y, highest=True)
        rows, columns = np.nonzero(height > heights(body, x, y))
        met = np.column_stack([x[columns], y[rows]])
        step = np.array([x[1] - x[0], y[1] - y[0]])
        low = met.min(axis=0, initial=np.inf) - step
        high = met.max(axis=0, initial=-np.inf) + step
        beyond = ((face_low[:, :2] < low) | (face_high[:, :2] > high)).any(axis=1)
        beyond &= face_low[:, 2] < height.max()
        places = _places_below(body.triangles[beyond], height, x, y)
        low = np.minimum(low, places.min(axis=0, initial=np.inf) - ROUNDING)
        high = np.maximum(high, places.max(axis=0, initial=-np.inf) + ROUNDING)
        if not (low < high).all():
            return None
        first, last = np.maximum(low, first), np.minimum(high, last)
        if ((last - first) >= FEWEST_STEPS * step).all():
            break
    return np.column_stack([first, last])


def _places_below(
    triangles: FloatArray, height: FloatArray, x: FloatArray, y: FloatArray
) -> FloatArray:
    """Return (n, 2) x and y (mm) of the corners of triangles (faces, 3, 3) below a skin, and of the
    places where their edges cross the skin.

    The heights (rows, columns), mm, of the skin on a grid, minus infinity without skin, are
    interpolated.
    """
    known = np.where(np.isfinite(height), height, NO_OVERLAP)
    column = ((triangles[..., 0] - x[0]) / (x[1] - x[0])).clip(0.0, len(x) - 1)
    row = ((triangles[..., 1] - y[0]) / (y[1] - y[0])).clip(0.0, len(y) - 1)
    left = np.minimum(column.astype(np.int64), len(x) - 2)
    front = np.minimum(row.astype(np.int64), len(y) - 2)
    right, back = column - left, row - front
    before = (1.0 - right) * known[front, left] + right * known[front, left + 1]
    behind = (1.0 - right) * known[front + 1, left] + right * known[front + 1, left + 1]
    gap = triangles[..., 2] - (1.0 - back) * before - back * behind
    next_gap, ends = np.roll(gap, -1, axis=1), np.roll(triangles, -1, axis=1)
    crossing = (gap < 0.0) != (next_gap < 0.0)
    share = (gap[crossing] / (gap[crossing] - next_gap[crossing]))[:, None]
    edges = (1.0 - share) * triangles[crossing] + share * ends[crossing]
    return np.concatenate([triangles[gap < 0.0], edges])[:, :2]


def _points(span: FloatArray, size: float, pitch: float) -> FloatArray:
    """Return coordinates (mm) of grid points that cover a size around the middle of a span."""
    number = POINTS_STEP * max(math.ceil(size / pitch / POINTS_STEP), 1)
    return np.asarray(span.mean() + pitch * (np.arange(number) - (number - 1) / 2))


def _points_across(overlap: FloatArray) -> float:
    """Return the mean width of an overlap in grid points: its area divided by half its perimeter.

    The perimeter follows by Crofton's formula from the number of neighbours of which only one lies
    in the overlap.
    """
    inside = overlap > 0.0
    rims = sum(int(np.count_nonzero(np.diff(inside, axis=axis))) for axis in (0, 1))
    return 8.0 / math.pi * np.count_nonzero(inside) / max(rims, 1)


def _step_below(pitch: float) -> float:
    """Round a pitch (mm) down to the geometric series of `PITCHES_PER_OCTAVE`."""
    step = math.floor(PITCHES_PER_OCTAVE * math.log2(pitch / FINEST_PITCH) + 1e-9)
    return float(FINEST_PITCH * 2.0 ** (step / PITCHES_PER_OCTAVE))


def _overlap(body: TriangleMesh, skin: TriangleMesh, x: FloatArray, y: FloatArray) -> FloatArray:
    depth = heights(outer_faces(skin, x, y), x, y, highest=True) - heights(body, x, y)
    return np.where(np.isfinite(depth), depth, NO_OVERLAP)


def outer_faces(skin: TriangleMesh, x: FloatArray, y: FloatArray) -> TriangleMesh:
    """Return the faces of a skin, in the frame of a contact, that face outward and lie in the
    rectangle of a grid with coordinates x (columns,) and y (rows,), mm.
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
