"""Domes: bodies with corners in horizontal rings over a vertical wall, and one at the top."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from optisense.array_types import FloatArray
from optisense.geometry import TriangleMesh
from optisense.workshop._recognised import SAME

FEWEST = 8
"""Smallest number of corners of a ring, and twice the smallest number of rings of a dome."""

MOST = 200
"""Largest number of rings; a mesh with more levels is not made of rings."""


@dataclass(frozen=True)
class Dome:
    """Dome over a vertical wall; its axis is z.

    Attributes:
        foot: z of the foot of the wall, mm.
        rings: corners (levels, n, 3) of the rings, from the upper end of the wall upward, mm;
            corner k of all rings is in about the same direction.
        top: top, (3,) mm.
    """

    foot: float
    rings: FloatArray
    top: FloatArray


def dome(mesh: TriangleMesh) -> Dome | None:
    """Return the dome of a mesh, closed by a flat foot or open there; None if it is no dome."""
    level = np.round(mesh.vertices[:, 2], 6)
    levels = np.unique(level)
    if not FEWEST // 2 < len(levels) <= MOST:
        return None
    tops = mesh.vertices[level == levels[-1]]
    if len(tops) != 1:
        return None
    middle = 0.5 * (mesh.bounds[0] + mesh.bounds[1])[:2]
    rings = [_around(mesh.vertices[level == z], middle) for z in levels[1:-1]]
    if min(len(ring) for ring in rings) < FEWEST:
        return None
    lowest = mesh.vertices[level == levels[0]][:, :2]
    for place in rings[0][:, :2]:  # the wall is vertical
        if np.abs(lowest - place).max(axis=1).min() > SAME:
            return None
    ways = _angles(rings[0], middle)
    if np.diff(ways).min() <= 0.0:
        return None
    even = np.array([_at(ring, ways, middle) for ring in rings])
    return Dome(float(levels[0]), even, tops[0])


def _angles(ring: FloatArray, middle: FloatArray) -> FloatArray:
    off = ring[:, :2] - middle
    return np.asarray(np.arctan2(off[:, 1], off[:, 0]))


def _around(ring: FloatArray, middle: FloatArray) -> FloatArray:
    """Return the corners of a ring in their order around its middle."""
    return ring[np.argsort(_angles(ring, middle))]


def _at(ring: FloatArray, ways: FloatArray, middle: FloatArray) -> FloatArray:
    """Return the points (n, 3), in mm, of a smooth curve through a ring's corners.

    Args:
        ring: (m, 3) mm, the corners in their order around the middle.
        ways: (n,) radians, directions from the middle.
        middle: (2,) mm.
    """
    reach = np.linalg.norm(ring[:, :2] - middle, axis=1)
    own = _angles(ring, middle)
    around = CubicSpline(
        np.append(own, own[0] + 2.0 * np.pi), np.append(reach, reach[0]), bc_type="periodic"
    )
    found = around(np.where(ways < own[0], ways + 2.0 * np.pi, ways))[:, None]
    way = np.column_stack([np.cos(ways), np.sin(ways)])
    return np.column_stack([middle + found * way, np.full(len(ways), ring[0, 2])])
