"""Domes: bodies whose corners lie in horizontal rings over a vertical wall, from the foot to one
top.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from optisense.geometry import TriangleMesh
from optisense.workshop.recognised import SAME

FloatArray = NDArray[np.float64]

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
    """Return the dome of a mesh, closed by a flat foot or open there; None if the mesh is no
    dome.
    """
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
    """Return the points of a ring in n directions from its middle, (n, 3) mm."""
    off = ring[:, :2] - middle
    own = _angles(ring, middle)
    after = np.searchsorted(own, ways, side="right") % len(own)
    one, side = off[after - 1], off[after] - off[after - 1]
    way = np.column_stack([np.cos(ways), np.sin(ways)])
    reach = (one[:, 0] * side[:, 1] - one[:, 1] * side[:, 0]) / (
        way[:, 0] * side[:, 1] - way[:, 1] * side[:, 0]
    )
    return np.column_stack([middle + reach[:, None] * way, np.full(len(ways), ring[0, 2])])
