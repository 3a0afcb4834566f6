"""Vertices of a mesh that round to the same place of a fine grid, and faces that occur twice."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

WELD_DISTANCE = 1e-6
"""Distance (mm) below which vertices count as one when edges are compared: about the rounding of
coordinates in mesh files of single precision."""


def welded(
    vertices: NDArray[np.float64], faces: NDArray[np.int32], distance: float
) -> tuple[NDArray[np.int64], NDArray[np.int32]]:
    """Merge vertices (n, 3) that agree to a distance, the side of the grid's cells, and drop faces
    (m, 3) that collapse; return the numbers (k,) of the remaining vertices, ascending, and faces.
    """
    kept, number = distinct(vertices, distance)
    merged = number[faces]
    whole = (merged != np.roll(merged, 1, axis=1)).all(axis=1)
    return kept, merged[whole]


def distinct(
    points: NDArray[np.float64], distance: float
) -> tuple[NDArray[np.int64], NDArray[np.int32]]:
    """Return the numbers (k,), ascending, of the first of all points (n, d) in each cell of a grid,
    whose cells have the side `distance`, and for each point (n,) the row of its cell's in these.
    """
    cells = np.round(points / distance).astype(np.int64)
    order = np.lexsort(cells.T)  # several times faster than sorting whole rows
    begins = np.ones(len(cells), dtype=bool)
    begins[1:] = (np.diff(cells[order], axis=0) != 0).any(axis=1)
    first = order[begins]
    rank = np.argsort(np.argsort(first))  # keep the points in their old order
    number = np.empty(len(cells), dtype=np.int32)
    number[order] = rank[np.cumsum(begins) - 1]
    return np.sort(first), number


def first_faces(faces: NDArray[np.integer], count: int) -> NDArray[np.int64]:
    """Return the faces (k,), of (m, 3) over `count` vertices, that do not repeat the corners and
    the winding of an earlier one.
    """
    start = faces.argmin(axis=1)  # a face may start at any of its corners
    turned = np.take_along_axis(faces, (start[:, None] + np.arange(3)) % 3, axis=1).astype(np.int64)
    # Rows are coded as single numbers, which sort ten times faster.
    _, ends = np.unique(turned[:, 0] * count + turned[:, 1], return_inverse=True)
    _, first = np.unique(ends * count + turned[:, 2], return_index=True)
    return np.sort(first)
