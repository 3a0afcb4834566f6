"""Sections of curved boards, along which the distances of their lights are measured."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import shapely

from optisense.array_types import FloatArray
from optisense.design.section import cut
from optisense.errors import DesignError
from optisense.geometry import TriangleMesh

APART = 1e-4
"""Smallest distance of corners of a section, and by which a place is beyond its end, mm: far below
the size of an LED, and far above the distance of points that belong to one vertex in the plane."""

BRIDGE_SIDES = 16
"""Number of sides of a curve over a gap. The polygon in a quarter of a circle is then shorter by
0.04 %."""


class Spot(NamedTuple):
    """A place on a section.

    Attributes:
        point: (3,) float64, the position, mm.
        normal: (3,) float64, the unit vector in the plane that is perpendicular to the section.
    """

    point: FloatArray
    normal: FloatArray


@dataclass(frozen=True)
class BoardSection:
    """Section of a curved board by a plane, whose gaps are bridged by smooth curves in the plane.

    Distances along it count from the line through the origin along the normal, so that they agree
    with the coordinate along it at small distances.

    Attributes:
        origin: (3,) a point of the plane, mm.
        axes: (2, 3) unit vectors of the plane: along the board and along its normal.
        points: (n, 2) corners of the section in the plane, mm.
        distances: (n,) distances of the corners along the section, mm.
    """

    origin: FloatArray
    axes: FloatArray
    points: FloatArray
    distances: FloatArray

    @classmethod
    def of(
        cls, board: TriangleMesh, origin: FloatArray, along: FloatArray, normal: FloatArray
    ) -> BoardSection | None:
        """Return the section of an open mesh by the plane of a point (3,), mm, and two
        perpendicular unit vectors (3,); None if it does not reach the line through the point along
        the normal. If it meets that line repeatedly, the place nearest to the point counts.

        Raises:
            DesignError: the section has no ends.
        """
        axes = np.stack([along, normal])
        found = cut(board, origin, np.cross(normal, along))
        lines = [line for each in found if len(line := _plain((each - origin) @ axes.T)) > 1]
        if not lines:
            return None
        points = _joined(lines)
        if np.linalg.norm(points[0] - points[-1]) <= APART:
            raise DesignError(
                "the surface has no edge at the ends of a row of lights",
                hint="Select faces with towards: (+z, -x, ...), or use a ring",
            )
        right = points[:, 0] > 0.0
        (crossing,) = np.nonzero(right[1:] != right[:-1])
        if not len(crossing):
            return None
        (x, y), (dx, dy) = points[crossing].T, np.diff(points, axis=0)[crossing].T
        share = -x / dx
        nearest = int(np.abs(y + share * dy).argmin())
        k = crossing[nearest]
        lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
        distances = np.append(0.0, np.cumsum(lengths))
        distances -= distances[k] + share[nearest] * lengths[k]
        if not right[k + 1]:
            points, distances = points[::-1], -distances[::-1]
        return cls(origin, axes, points, distances)

    def at(self, distance: float) -> Spot | None:
        """Return the place at a distance, mm, along the section; None beyond its ends."""
        if not self.distances[0] - APART <= distance <= self.distances[-1] + APART:
            return None
        k = int(np.searchsorted(self.distances[1:-1], distance, side="right"))
        side = self.points[k + 1] - self.points[k]
        side /= np.linalg.norm(side)
        place = self.points[k] + (distance - self.distances[k]) * side
        normal = np.array([-side[1], side[0]])
        return Spot(self.origin + place @ self.axes, normal @ self.axes)


def _plain(line: FloatArray) -> FloatArray:
    """Return a line (n, 2), mm, without points that coincide with the one before."""
    return line[np.append(True, np.linalg.norm(np.diff(line, axis=0), axis=1) > APART)]


def _joined(lines: list[FloatArray]) -> FloatArray:
    """Return the line (n, 2), mm, that is nearest to (0, 0), with those that continue it at both
    ends.
    """
    middle = shapely.Point(0.0, 0.0)
    line, *rest = sorted(lines, key=lambda each: shapely.LineString(each).distance(middle))
    for _ in range(2):  # at one end, and then at the other
        while (found := _continuation(line, rest)) is not None:
            number, other = found
            rest.pop(number)
            line = np.concatenate([line, _bridge(line[-2:], other[:2])[1:-1], other])
        line = line[::-1]
    return line


def _continuation(line: FloatArray, rest: list[FloatArray]) -> tuple[int, FloatArray] | None:
    """Return the number of the line that begins nearest to the end of a line, ahead of it, and that
    line in the direction that leads on.
    """
    best, found = np.inf, None
    for number, one in enumerate(rest):
        for other in (one, one[::-1]):
            step = other[0] - line[-1]
            ahead = step @ (line[-1] - line[-2]) > 0.0 and step @ (other[1] - other[0]) > 0.0
            if ahead and step @ step < best:
                best, found = float(step @ step), (number, other)
    return found


def _bridge(before: FloatArray, after: FloatArray) -> FloatArray:
    """Return points (n, 2) of a curve that continues one side (2, 2) smoothly to the next, mm.

    It is a cubic Hermite curve, which follows a circle if both sides touch one: between tangents
    that meet its chord at an angle a, those of a circle have the length 2 chord / (1 + cos a).
    """
    chord = after[0] - before[1]
    length = np.linalg.norm(chord)
    ways = np.stack([before[1] - before[0], after[1] - after[0]])
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    out, into = (2.0 * length**2 / (length + ways @ chord))[:, None] * ways
    t = np.linspace(0.0, 1.0, BRIDGE_SIDES + 1)[:, None]
    ends = before[1] + t**2 * (3.0 - 2.0 * t) * chord
    return np.asarray(ends + t * (1.0 - t) * ((1.0 - t) * out - t * into))
