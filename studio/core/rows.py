"""Rows of lights on a face."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

OFF_LINE = 0.1
"""The largest distance of a row's lights from its line, as a share of its length."""

SHORTEST = 1e-6
"""mm: shorter edges have no direction, and places that are nearer to one another are one."""


@dataclass(frozen=True)
class Row:
    """Lights on a line.

    Attributes:
        middle: (3,) mm, between the first and the last.
        along: (3,) unit, from the first to the last.
        pitch: mm, mean distance of neighbours; 0 for a single light.
    """

    middle: FloatArray
    along: FloatArray
    pitch: float

    def places(self, count: int, pitch: float) -> FloatArray:
        """(count, 3) mm: lights with another pitch about the same middle."""
        shifts = (np.arange(count) - (count - 1) / 2) * pitch
        return self.middle + shifts[:, None] * self.along


def row_through(positions: Sequence[Sequence[float]]) -> Row | None:
    """The row in which lights stand, in the order given; None where they stand in no row.

    Args:
        positions: (n, 3) mm. A single light is a row along x.
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
    """Return the place (3,) on the edge nearest to a row's middle, and that edge's way (3,).

    Edges of no length are none. Where several meet at that place, the one counts that runs most
    along the row.

    Args:
        row: of lights.
        edges: (n, 2, 3) mm, their ends.

    Returns:
        mm and a unit vector that runs with the row, not against it; None without edges.
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
    """Poses of lights in a row through the middle of a face, along its longer side.

    Args:
        corners: (n, 3) mm, vertices of the face.
        normal: (3,) of the face, of any length but zero.
        target: (3,) mm; the lights shine along the normal, to the side where this is.
        count: how many lights.
        pitch: mm between neighbours.
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
