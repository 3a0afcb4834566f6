"""Flat outlines with a straight end and a half-round end, and solids stacked of them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from optisense.geometry import TriangleMesh
from optisense.sensors.shapes import ASIDE, arc

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class HalfRound:
    """An outline of two straight sides, a half round towards +y, and a straight end towards -y.

    Attributes:
        width: mm, along x; the half round has half of it as its radius.
        straight: mm, from the straight end to the centre of the half round.
        corner: mm, radius of the two corners of the straight end.
        centre: mm, y of the centre of the half round; its x is 0.
    """

    width: float
    straight: float
    corner: float
    centre: float

    @property
    def radius(self) -> float:
        """mm, of the half round."""
        return 0.5 * self.width

    @property
    def end(self) -> float:
        """mm, y of the straight end."""
        return self.centre - self.straight

    @property
    def length(self) -> float:
        """mm, along y."""
        return self.straight + self.radius

    def inset(self, distance: float) -> HalfRound:
        """The outline that lies `distance` mm inside this one."""
        corner = max(self.corner - distance, 0.25 * self.corner)
        return HalfRound(self.width - 2.0 * distance, self.straight - distance, corner, self.centre)

    def points(self, tessellation: float) -> FloatArray:
        """(n, 2) corners of a polygon in the outline, counter-clockwise, in mm.

        Each piece is cut into an odd number, so that no corner lies on the y axis. The numbers
        follow from this outline's `tessellation`; use `like` for outlines inside it.

        Args:
            tessellation: mm, about the length of the sides.
        """
        return self._cut(self._pieces(tessellation))

    def like(self, outer: HalfRound, tessellation: float) -> FloatArray:
        """`points` with as many corners on each piece as those of another outline."""
        return self._cut(outer._pieces(tessellation))

    def _pieces(self, tessellation: float) -> tuple[int, int, int, int]:
        """The numbers of points of the end, a corner, a side and the half round."""

        def odd(length: float, least: int) -> int:
            return 2 * (max(least, math.ceil(length / tessellation)) // 2) + 1

        return (
            odd(self.width - 2.0 * self.corner, 1),
            odd(0.5 * math.pi * self.corner, 4),
            odd(self.straight - self.corner, 1),
            odd(math.pi * self.radius, 24),
        )

    def _cut(self, pieces: tuple[int, int, int, int]) -> FloatArray:
        end, corner, side, half = pieces
        inner = self.radius - self.corner
        low = self.end + self.corner
        parts = [
            _line((-inner, self.end), (inner, self.end), end),
            arc((inner, low), self.corner, -90.0, 0.0, corner),
            _line((self.radius, low), (self.radius, self.centre), side),
            arc((0.0, self.centre), self.radius, 0.0, 180.0, half),
            _line((-self.radius, self.centre), (-self.radius, low), side),
            arc((-inner, low), self.corner, 180.0, 270.0, corner),
        ]
        return np.concatenate([part[:-1] for part in parts])

    def at(self, distance: float) -> tuple[tuple[float, float], tuple[float, float]]:
        """A place on the outline, and the unit vector that looks out of it there.

        Args:
            distance: mm along the outline from the middle of the straight end; towards +x first
                where it is positive.
        """
        along = abs(distance)
        sign = math.copysign(1.0, distance)
        flat = self.radius - self.corner
        bend = 0.5 * math.pi * self.corner
        side = self.straight - self.corner
        if along <= flat:
            x, y, out = along, self.end, (0.0, -1.0)
        elif along <= flat + bend:
            angle = (along - flat) / self.corner
            out = (math.sin(angle), -math.cos(angle))
            x, y = flat + self.corner * out[0], self.end + self.corner + self.corner * out[1]
        elif along <= flat + bend + side:
            x, y, out = self.radius, self.end + self.corner + along - flat - bend, (1.0, 0.0)
        else:
            angle = (along - flat - bend - side) / self.radius
            out = (math.cos(angle), math.sin(angle))
            x, y = self.radius * out[0], self.centre + self.radius * out[1]
        return (sign * x, y), (sign * out[0], out[1])

    @property
    def half_way(self) -> float:
        """mm along the outline from the middle of the straight end to the middle of the round."""
        flat, bend = self.radius - self.corner, 0.5 * math.pi * self.corner
        return flat + bend + self.straight - self.corner + 0.5 * math.pi * self.radius


def stacked(rings: Sequence[FloatArray]) -> TriangleMesh:
    """A closed solid whose outside is a sequence of rings, closed by a fan at both ends.

    Args:
        rings: (n, 3) mm each; rings of one length are joined corner by corner, others by the
            share of the way around. Seen from outside of the solid, the rings run
            counter-clockwise about +z from the first (below) to the last (above); a solid with
            a cavity goes from the cavity's floor up, over its rim and down outside.
    """
    vertices = np.concatenate([*rings, [_pole(rings[0])], [_pole(rings[-1])]])
    starts = np.cumsum([0, *(len(ring) for ring in rings)])
    faces = [
        np.where(between < len(below), between + starts[k], between - len(below) + starts[k + 1])
        for k, (below, above) in enumerate(pairwise(rings))
        for between in [_joined(len(below), len(above))]
    ]
    first, last = np.arange(len(rings[0])), starts[-2] + np.arange(len(rings[-1]))
    low, high = np.full(len(first), starts[-1]), np.full(len(last), starts[-1] + 1)
    faces.append(np.column_stack([np.roll(first, -1), first, low]))
    faces.append(np.column_stack([last, np.roll(last, -1), high]))
    return TriangleMesh(vertices, np.concatenate(faces).astype(np.int32))


def _joined(below: int, above: int) -> NDArray[np.int64]:
    """(below + above, 3) faces between two rings of so many corners, those above numbered on."""
    ends = np.concatenate([(np.arange(below) + 1.0) / below, (np.arange(above) + 1.0) / above])
    is_below = np.arange(below + above) < below
    order = np.lexsort((is_below, ends))  # the way around; each step is one triangle
    steps = is_below[order]
    i = np.concatenate([[0], np.cumsum(steps)[:-1]])
    j = np.concatenate([[0], np.cumsum(~steps)[:-1]])
    ahead = np.where(steps, (i + 1) % below, below + (j + 1) % above)
    return np.column_stack([i % below, ahead, below + j % above])


def _pole(ring: FloatArray) -> FloatArray:
    """The middle of a ring, a little aside: a camera on the axis would look along edges there."""
    middle = 0.5 * (ring.min(axis=0) + ring.max(axis=0))
    reach = np.abs(ring - middle).max(axis=0)
    return np.asarray(middle + ASIDE * reach * np.array([0.61, 0.79, 0.0]))


def _line(start: tuple[float, float], end: tuple[float, float], pieces: int) -> FloatArray:
    return np.linspace(start, end, pieces + 1)
