"""Path of a belt, made of straight runs and bends, and its parallel curves."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from optisense.array_types import FloatArray
from optisense.sensors._shapes import arc, pieces_of_arc

BEND_PIECE = 1.0
"""Largest angle of a piece of a bend, degrees. Between metal coatings, light is guided around
GelBelt's wheels: with pieces of 4.5 degrees, an eighth less green light arrives in a contact."""


@dataclass(frozen=True)
class Straight:
    """Straight run of `length` mm."""

    length: float


@dataclass(frozen=True)
class Bend:
    """Bend down by `angle` degrees around a wheel of `radius` mm inside the loop."""

    radius: float
    angle: float


@dataclass(frozen=True)
class BeltHalf:
    """Half of the inner face of a belt, from x = 0 in the direction of +x.

    Attributes:
        points: x and z of the points, (n, 2) mm.
        normals: unit normals (n, 2) out of the loop; the belt lies on that side.
        starts: index of the first point of each run and bend, then the index of the last point.
        bends: centre (x, z) of each bend, mm, by its number among the runs and bends.
    """

    points: FloatArray
    normals: FloatArray
    starts: list[int]
    bends: dict[int, tuple[float, float]]

    def raised(self, height: float) -> FloatArray:
        """Return the curve `height` mm outside the inner face, point by point, (n, 2) mm."""
        return self.points + height * self.normals

    def wheel(self, number: int, gap: float, tessellation: float) -> FloatArray:
        """Return the outline of the wheel of a bend, (k, 2) mm, counter-clockwise, with pieces of
        about `tessellation` mm.

        The gap (mm) between belt and wheel is the same everywhere, as the wheel has its corners
        below those of the belt.
        """
        beside = self.raised(-gap)[self.starts[number] : self.starts[number + 1] + 1][::-1]
        centre = self.bends[number]
        (x1, z1), (x0, z0) = beside[-1] - centre, beside[0] - centre
        end, start = math.degrees(math.atan2(z1, x1)), math.degrees(math.atan2(z0, x0))
        radius, rest = math.hypot(x0, z0), (start - end) % 360.0
        pieces = pieces_of_arc(radius, rest, tessellation, least=8)
        return np.concatenate([beside, arc(centre, radius, end, end + rest, pieces)[1:-1]])


def trace(pieces: Sequence[Straight | Bend], level: float, tessellation: float) -> BeltHalf:
    """Return the inner face of a belt along its runs and bends, in pieces of about `tessellation`
    mm; at x = 0, where it runs along +x, its z is `level`, mm.
    """
    place, angle = np.array([0.0, level]), 0.0
    points, normals, starts, bends = [place[None]], [_normal(angle)[None]], [0], {}
    count = 0
    for number, piece in enumerate(pieces):
        if isinstance(piece, Straight):
            steps = max(1, math.ceil(piece.length / tessellation))
            share = np.arange(1, steps + 1)[:, None] / steps
            normal = _normal(angle)
            along = np.array([normal[1], -normal[0]])
            points.append(place + share * piece.length * along)
            normals.append(np.repeat(normal[None], steps, axis=0))
        else:
            least = math.ceil(abs(piece.angle) / BEND_PIECE)
            steps = pieces_of_arc(piece.radius, piece.angle, tessellation, least)
            centre = place - piece.radius * _normal(angle)
            turns = angle + piece.angle * np.arange(1, steps + 1) / steps
            across = np.array([_normal(turn) for turn in turns])
            points.append(centre + piece.radius * across)
            normals.append(across)
            bends[number] = (float(centre[0]), float(centre[1]))
            angle += piece.angle
        count += steps
        starts.append(count)
        place = points[-1][-1]
    return BeltHalf(np.concatenate(points), np.concatenate(normals), starts, bends)


def mirrored_and_joined(left: FloatArray, right: FloatArray) -> FloatArray:
    """Return one curve (k, 2), mm, from left to right, made of two halves (n, 2) that begin at x =
    0 and of which the left one is mirrored to the right.
    """
    return np.concatenate([left[:0:-1] * (-1.0, 1.0), right])


def way_back(left: BeltHalf, right: BeltHalf) -> tuple[float, float]:
    """Return the length of the inner face that is modelled, and of the straight run in which the
    belt closes behind its two wheels, mm; each half is given as if it lay on the right.

    This run, and half a turn around a wheel, are not modelled.
    """
    (x0, z0), (x1, z1) = left.bends[max(left.bends)], right.bends[max(right.bends)]
    drawn = sum(
        float(np.linalg.norm(np.diff(half.points, axis=0), axis=1).sum()) for half in (left, right)
    )
    return drawn, math.hypot(x1 + x0, z1 - z0)


def _normal(angle: float) -> FloatArray:
    """Return the outward unit normal (2,) of a belt that is turned down by `angle` degrees."""
    return np.array([math.sin(math.radians(angle)), math.cos(math.radians(angle))])
