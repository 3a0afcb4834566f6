"""Flat outlines with a straight end and a half-round end, and solids stacked of them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from optisense.array_types import FloatArray
from optisense.geometry import TriangleMesh
from optisense.sensors._shapes import ASIDE, arc


@dataclass(frozen=True)
class HalfRound:
    """Outline of two straight sides, a half round towards +y, and a straight end towards -y.

    Attributes:
        width: width along x, mm; the half round has half of it as its radius.
        straight: distance from the straight end to the centre of the half round, mm.
        corner: radius of the two corners of the straight end, mm.
        centre: y of the centre of the half round, mm; its x is 0.
    """

    width: float
    straight: float
    corner: float
    centre: float

    @property
    def radius(self) -> float:
        """Radius of the half round, mm."""
        return 0.5 * self.width

    @property
    def end(self) -> float:
        """y of the straight end, mm."""
        return self.centre - self.straight

    @property
    def length(self) -> float:
        """Length along y, mm."""
        return self.straight + self.radius

    def inset(self, distance: float) -> HalfRound:
        """Return the outline that lies `distance` mm inside this one."""
        corner = max(self.corner - distance, 0.25 * self.corner)
        return HalfRound(self.width - 2.0 * distance, self.straight - distance, corner, self.centre)

    def points(self, tessellation: float) -> FloatArray:
        """Return the corners (n, 2), mm, of a polygon in the outline, counter-clockwise, with sides
        of about `tessellation` mm.

        Each piece is divided into an odd number, so that no corner lies on the y axis. Outlines
        inside it take as many corners by `like`.
        """
        return self._cut(self._pieces(tessellation))

    def like(self, outer: HalfRound, tessellation: float) -> FloatArray:
        """Return `points` with as many corners on each piece as those of another outline."""
        return self._cut(outer._pieces(tessellation))

    def _pieces(self, tessellation: float) -> tuple[int, int, int, int]:
        """Return the numbers of points of the end, a corner, a side and the half round."""

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
            np.linspace((-inner, self.end), (inner, self.end), end + 1),
            arc((inner, low), self.corner, -90.0, 0.0, corner),
            np.linspace((self.radius, low), (self.radius, self.centre), side + 1),
            arc((0.0, self.centre), self.radius, 0.0, 180.0, half),
            np.linspace((-self.radius, self.centre), (-self.radius, low), side + 1),
            arc((-inner, low), self.corner, 180.0, 270.0, corner),
        ]
        return np.concatenate([part[:-1] for part in parts])

    def at(self, distance: float) -> tuple[tuple[float, float], tuple[float, float]]:
        """Return the point at a distance (mm) along the outline from the middle of the straight
        end, towards +x first if positive, and its outward unit normal.
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
        """Distance along the outline from the middle of the straight end to the round's, mm."""
        flat, bend = self.radius - self.corner, 0.5 * math.pi * self.corner
        return flat + bend + self.straight - self.corner + 0.5 * math.pi * self.radius


def stacked(rings: Sequence[FloatArray]) -> TriangleMesh:
    """Return a closed solid whose outside is a sequence of rings (n, 3), mm, closed by a fan at
    both ends.

    Rings of one length are joined corner by corner, others by the share of the perimeter. Seen from
    outside of the solid, the rings run counter-clockwise about +z from the first (below) to the
    last (above); a solid with a cavity goes from the cavity's floor up, over its rim and down
    outside.
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
    """Return the faces (below + above, 3) between two rings; the corners of the upper ring are
    numbered after those of the lower.
    """
    ends = np.concatenate([(np.arange(below) + 1.0) / below, (np.arange(above) + 1.0) / above])
    is_below = np.arange(below + above) < below
    order = np.lexsort((is_below, ends))  # in the order around the ring; each step is one triangle
    steps = is_below[order]
    i = np.concatenate([[0], np.cumsum(steps)[:-1]])
    j = np.concatenate([[0], np.cumsum(~steps)[:-1]])
    ahead = np.where(steps, (i + 1) % below, below + (j + 1) % above)
    return np.column_stack([i % below, ahead, below + j % above])


def _pole(ring: FloatArray) -> FloatArray:
    """Return the middle of a ring, slightly off it: a camera on the axis would look along edges
    there.
    """
    middle = 0.5 * (ring.min(axis=0) + ring.max(axis=0))
    reach = np.abs(ring - middle).max(axis=0)
    return np.asarray(middle + ASIDE * reach * np.array([0.61, 0.79, 0.0]))
