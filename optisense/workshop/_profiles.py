"""Reconstruction of the lines, arcs and smooth curves of flat outlines from the corners of a mesh.

A mesh keeps only corners. Corners on one line, or on one circle in equal steps, come from a line or
an arc; smooth runs of other corners are taken for points on a curve.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Literal, NamedTuple

import numpy as np

from optisense.array_types import FloatArray

EXACT = 2e-6
"""Largest deviation of corners from their line or circle, mm; it covers rounding in files."""

ARC_CORNERS = 5
"""Smallest number of corners on one circle that make an arc; three always lie on a circle."""

SMOOTH = 20.0
"""Largest angle between neighbouring sides of a smooth curve, degrees: polygons of 18 sides and
more count as circles."""

SMOOTH_SAGITTA = 0.05
"""Largest distance of a smooth curve from the sides of its polygon, mm; five times the tolerance of
a good export. Long sides that stand farther from any curve through their corners are meant flat."""

ALIKE = 2.0
"""Largest ratio of the lengths of neighbouring sides of a smooth curve. Corners on curves come in
steady steps; a longer side beside them is a straight one, such as that of a mitred corner."""

CURVE_CORNERS = 6
"""Smallest number of corners in a smooth run that make a curve: one more than for an arc, whose
circle is a stronger sign than a smooth run."""


class Arc(NamedTuple):
    """Arc of a circle.

    Attributes:
        centre: centre, (2,) mm.
        radius: radius, mm.
        start: angle of its first end, radians.
        sweep: angle to its other end, radians, positive if anticlockwise.
    """

    centre: FloatArray
    radius: float
    start: float
    sweep: float

    def points(self, count: int) -> FloatArray:
        """Return points (count, 2), mm, on it in equal steps."""
        angles = self.start + self.sweep * np.linspace(0.0, 1.0, count)
        return self.centre + self.radius * np.column_stack([np.cos(angles), np.sin(angles)])


class OutlinePiece(NamedTuple):
    """Part of an outline.

    Attributes:
        kind: kind of the part.
        points: corners (n, 2), mm; for a line the two ends, for an arc the ends and one in between.
    """

    kind: Literal["line", "arc", "curve"]
    points: FloatArray

    def arc(self) -> Arc:
        """Return the circle of a piece that is an arc, and the angles of its ends."""
        centre = centre_of(*self.points)
        assert centre is not None
        (ax, ay), (bx, by) = np.diff(self.points, axis=0)
        start, end = (float(np.arctan2(*(self.points[k] - centre)[::-1])) for k in (0, 2))
        anticlockwise = ax * by - ay * bx > 0.0
        sweep = (end - start) % (2.0 * np.pi) if anticlockwise else -((start - end) % (2.0 * np.pi))
        return Arc(centre, float(np.linalg.norm(self.points[0] - centre)), start, sweep)


def pieces(corners: FloatArray) -> list[OutlinePiece]:
    """Return the lines, arcs and curves of an open polygon with corners (n, 2), mm; a closed
    outline repeats the first at the end.
    """
    found: list[OutlinePiece] = []
    loose: list[int] = []
    start = 0
    while start < len(corners) - 1:
        line, arc = _line_end(corners, start), _arc_end(corners, start)
        if arc - start >= ARC_CORNERS - 1 and arc > line:
            found += _loose(corners, loose)
            loose = []
            between = (start + arc) // 2
            found.append(OutlinePiece("arc", corners[[start, between, arc]]))
            start = arc
        elif line - start >= 2:
            found += _loose(corners, loose)
            loose = []
            found.append(OutlinePiece("line", corners[[start, line]]))
            start = line
        else:
            loose = loose or [start]
            loose.append(start + 1)
            start += 1
    return found + _loose(corners, loose)


def _line_end(corners: FloatArray, start: int) -> int:
    """Return the last corner on the line through a corner and the next one."""
    end = start + 1
    while end + 1 < len(corners):
        way = corners[end + 1] - corners[start]
        length = np.linalg.norm(way)
        off = corners[start + 1 : end + 1] - corners[start]
        away = np.abs(off[:, 0] * way[1] - off[:, 1] * way[0]) / max(length, 1e-12)
        along = off @ way / max(length, 1e-12)
        if away.max() > EXACT or along.min() < 0.0 or along.max() > length:
            break
        end += 1
    return end


def _arc_end(corners: FloatArray, start: int) -> int:
    """Return the last corner on the circle through a corner and the next two; `start` if none.

    The sides must bend in one direction and by no more than 20 degrees each.
    """
    if start + 2 >= len(corners):
        return start
    centre = centre_of(*corners[start : start + 3])
    if centre is None:
        return start
    radius = float(np.linalg.norm(corners[start] - centre))
    end, sense, turned = start, 0.0, 0.0
    while end + 1 < len(corners):
        one, other = corners[end] - centre, corners[end + 1] - centre
        angle = float(np.arctan2(one[0] * other[1] - one[1] * other[0], one @ other))
        off = abs(float(np.linalg.norm(other)) - radius)
        sense = sense or np.sign(angle)
        turned += abs(angle)
        if off > EXACT or angle * sense <= 0.0 or abs(angle) > np.radians(SMOOTH) or turned > 6.0:
            break
        end += 1
    return end


def centre_of(a: FloatArray, b: FloatArray, c: FloatArray) -> FloatArray | None:
    """Return the centre of the circle through three points, or None if they lie on one line."""
    ab, ac = b - a, c - a
    twice = 2.0 * (ab[0] * ac[1] - ab[1] * ac[0])
    if abs(twice) < 1e-9 * (ab @ ab + ac @ ac):
        return None
    x = (ac[1] * (ab @ ab) - ab[1] * (ac @ ac)) / twice
    y = (ab[0] * (ac @ ac) - ac[0] * (ab @ ab)) / twice
    return np.asarray(a + np.array([x, y]))


def _loose(corners: FloatArray, run: list[int]) -> list[OutlinePiece]:
    """Return curves and lines through corners that lie on no line and no circle."""
    if not run:
        return []
    points = corners[run]
    sides = np.diff(points, axis=0)
    lengths = np.linalg.norm(sides, axis=1)
    sides /= lengths[:, None]
    bends = np.arccos(np.clip((sides[1:] * sides[:-1]).sum(axis=1), -1.0, 1.0))
    # An arc that turns by this angle over a side stands off from it by an eighth of their product.
    longer = np.maximum(lengths[1:], lengths[:-1])
    sharp = (bends > np.radians(SMOOTH)) | (longer * bends / 8.0 > SMOOTH_SAGITTA)
    sharp |= longer > ALIKE * np.minimum(lengths[1:], lengths[:-1])
    cuts = [0, *(np.flatnonzero(sharp) + 1).tolist(), len(points) - 1]
    found: list[OutlinePiece] = []
    for low, high in pairwise(cuts):
        part = points[low : high + 1]
        if len(part) >= CURVE_CORNERS:
            found.append(OutlinePiece("curve", part))
        else:
            found += [OutlinePiece("line", part[k : k + 2]) for k in range(len(part) - 1)]
    return found
