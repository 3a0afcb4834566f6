"""The sensor with every triangle of its sensing surface, for chief rays."""

from __future__ import annotations

from typing import NamedTuple

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from optisense.optics.scene.ray_scene import Piece, RayScene
from optisense.optics.scene.surfaces import Region


class FineScene(NamedTuple):
    """A scene in which flat parts of the sensing surface keep their triangles.

    Attributes:
        pieces: its pieces.
        scene: the ray scene.
        sensing_faces: number (m,) of the triangle of the sensing surface for each triangle of the
            scene, or -1.
    """

    pieces: list[Piece]
    scene: RayScene
    sensing_faces: NDArray[np.int64]


def fine_scene(pieces: list[Piece], table: mi.Float) -> FineScene:
    """Return the scene of pieces.

    Args:
        pieces: the pieces; those of the sensing surface with all their triangles.
        table: the table (16 n,) of the surfaces of the n pieces, in the same order
            (`surface_table`).
    """
    numbers, start = [], 0
    for piece in pieces:
        count = len(piece.faces)
        if piece.surface.region is Region.SENSING:
            numbers.append(np.arange(start, start + count))
            start += count
        else:
            numbers.append(np.full(count, -1, dtype=np.int64))
    return FineScene(pieces, RayScene(pieces, table=table, robust=True), np.concatenate(numbers))
