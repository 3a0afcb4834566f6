"""Merging of the vertices of a mesh that round to the same place of a fine grid."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

WELD_DISTANCE = 1e-6
"""Distance (mm) below which vertices count as one when edges are compared: about the rounding of
coordinates in mesh files of single precision."""


def welded(
    vertices: NDArray[np.float64], faces: NDArray[np.int32], distance: float
) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Merge vertices that agree to a distance, and drop faces that collapse.

    Args:
        vertices: (n, 3) vertices, mm.
        faces: (m, 3) rows of `vertices`.
        distance: side of the grid's cells, mm.

    Returns:
        The remaining vertices, in their old order, and the remaining faces.
    """
    cells = np.round(vertices / distance).astype(np.int64)
    order = np.lexsort(cells.T)  # several times faster than sorting whole rows
    begins = np.ones(len(cells), dtype=bool)
    begins[1:] = (np.diff(cells[order], axis=0) != 0).any(axis=1)
    first = order[begins]
    rank = np.argsort(np.argsort(first))  # keep the vertices in their old order
    number = np.empty(len(cells), dtype=np.int32)
    number[order] = rank[np.cumsum(begins) - 1]
    merged = number[faces]
    whole = (
        (merged[:, 0] != merged[:, 1])
        & (merged[:, 1] != merged[:, 2])
        & (merged[:, 2] != merged[:, 0])
    )
    return vertices[np.sort(first)], merged[whole]
