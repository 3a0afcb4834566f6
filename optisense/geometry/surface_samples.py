"""Points that are spread evenly over a mesh, each with its share of the area."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from optisense.array_types import FloatingArray


def surface_samples(
    vertices: FloatingArray, faces: NDArray[np.integer], spacing: float
) -> tuple[FloatingArray, NDArray[np.integer], FloatingArray]:
    """Spread sample points evenly over a mesh, about one per ``spacing`` squared.

    Returns:
        Points (3, n), mm; the face (n,) that each lies on; and its share (n,), mm^2, of the area of
        the face.
    """
    a, b, c = (vertices[faces[:, k]].T.copy() for k in range(3))
    area = np.linalg.norm(np.cross((b - a).T, (c - a).T), axis=1) / 2
    count = np.maximum(1, np.ceil(area / spacing**2)).astype(int)
    owner = np.repeat(np.arange(len(faces)), count)
    # The R2 sequence (Roberts 2018), folded into the triangle by the square-root map. One sequence
    # runs through all faces; restarted in each, it would favour the same corner of small faces and
    # concentrate area in the middle of a fan.
    order = np.arange(1, len(owner) + 1)
    u = np.mod(0.5 + 0.7548776662466927 * order, 1.0)
    v = np.mod(0.5 + 0.5698402909980532 * order, 1.0)
    root = np.sqrt(u)
    points = np.empty((3, len(owner)))
    for k in range(3):
        across = b[k][owner] * (1 - v) + c[k][owner] * v
        points[k] = a[k][owner] * (1 - root) + across * root
    return points, owner, (area / count)[owner]
