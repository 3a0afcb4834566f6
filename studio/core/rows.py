"""Rows of lights on a face."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

OFF_LINE = 0.1
"""Largest distance of a row's lights from its line, as a share of its length."""

SHORTEST = 1e-6
"""Length in mm below which an edge has no direction, and two places are one."""


@dataclass(frozen=True)
class Row:
    """Row of lights on a straight line.

    Attributes:
        middle: point midway between the first and the last light, (3,) mm.
        along: unit vector from the first to the last light, (3,).
        pitch: mean distance of neighbours, mm; 0 for a single light.
    """

    middle: FloatArray
    along: FloatArray
    pitch: float

    def places(self, count: int, pitch: float) -> FloatArray:
        """Return positions (count, 3), mm, of a row with another count and pitch, same middle."""
        shifts = (np.arange(count) - (count - 1) / 2) * pitch
        return self.middle + shifts[:, None] * self.along


def row_through(positions: Sequence[Sequence[float]]) -> Row | None:
    """Return the row in which lights stand, in the order given; None if they are not on a line.

    Args:
        positions: positions of the lights, (n, 3) mm. A single light is a row along x.
    """
    places = np.array(positions, dtype=np.float64).reshape(-1, 3)
    if len(places) == 0:
        return None
    middle = (places[0] + places[-1]) / 2
    if len(places) == 1:
        return Row(middle, np.array((1.0, 0.0, 0.0)), 0.0)
    _, _, axes = np.linalg.svd(places - places.mean(axis=0), full_matrices=False)
    shares = (places - places.mean(axis=0)) @ axes[0]
    along = axes[0] * (1.0 if shares[-1] >= shares[0] else -1.0)
    length = float(np.ptp(shares))
    beside = (places - places.mean(axis=0)) - np.outer(shares, axes[0])
    if length < 1e-9 or np.linalg.norm(beside, axis=1).max() > OFF_LINE * length:
        return None
    middle = places.mean(axis=0) + (shares.min() + shares.max()) / 2 * axes[0]
    return Row(middle, along, length / (len(places) - 1))


def nearest_edge(row: Row, edges: FloatArray) -> tuple[FloatArray, FloatArray] | None:
    """Return the point on the edge nearest to a row's middle, and the direction of that edge.

    Edges without length are ignored. Where several edges meet at the nearest point, the one most
    parallel to the row is taken.

    Args:
        edges: ends of the edges, (n, 2, 3) mm.

    Returns:
        Point (3,) in mm and unit vector (3,), which runs with the row, not against it; None without
        edges.
    """
    ways = edges[:, 1] - edges[:, 0]
    lengths = np.linalg.norm(ways, axis=1)
    kept = lengths > SHORTEST
    if not kept.any():
        return None
    starts, lengths = edges[kept, 0].astype(np.float64), lengths[kept].astype(np.float64)
    ways = ways[kept] / lengths[:, None]
    shares = np.clip(((row.middle - starts) * ways).sum(axis=1), 0.0, lengths)
    places = starts + shares[:, None] * ways
    away = np.linalg.norm(places - row.middle, axis=1)
    near = np.flatnonzero(away <= away.min() + SHORTEST)
    best = near[np.argmax(np.abs(ways[near] @ row.along))]
    along = ways[best] * (1.0 if ways[best] @ row.along >= 0.0 else -1.0)
    return places[best], along


def row_on_face(
    corners: FloatArray, normal: FloatArray, target: FloatArray, count: int, pitch: float
) -> list[dict[str, Any]]:
    """Return the poses of lights in a row through the middle of a face, along its longer side.

    Args:
        corners: vertices of the face, (n, 3) mm.
        normal: normal of the face, (3,), of any length but zero.
        target: point (3,) in mm on the side to which the lights shine, along the normal.
        count: number of lights.
        pitch: distance between neighbours, mm.
    """
    way = normal / np.linalg.norm(normal)
    middle = (corners.min(axis=0) + corners.max(axis=0)) / 2
    if way @ (target - middle) < 0.0:
        way = -way
    flat = (corners - middle) - np.outer((corners - middle) @ way, way)
    _, _, axes = np.linalg.svd(flat, full_matrices=False)
    along = axes[0] - (axes[0] @ way) * way
    along /= np.linalg.norm(along)
    along *= np.sign(along[np.argmax(np.abs(along))])
    up = np.cross(way, along)
    shifts = (np.arange(count) - (count - 1) / 2) * pitch
    return [
        {
            "position": [round(float(x), 6) + 0.0 for x in middle + shift * along],
            "direction": [round(float(x), 6) + 0.0 for x in way],
            "up": [round(float(x), 6) + 0.0 for x in up],
        }
        for shift in shifts
    ]
