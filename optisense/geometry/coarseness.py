"""The error of a bent mesh whose triangles are too large to follow its cage."""

from __future__ import annotations

import weakref
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from optisense.array_types import FloatArray
from optisense.geometry.cage import Resolution, cage_weights, deform
from optisense.geometry.mesh import TriangleMesh

LONGEST_EDGES = 64
"""Number of edges whose deviation is measured: the longest ones of a mesh, as the deviation grows
as the square of the length."""

_longest: weakref.WeakKeyDictionary[TriangleMesh, NDArray[np.int32]] = weakref.WeakKeyDictionary()


class ChordError(NamedTuple):
    """The largest distance of a bent mesh from the exact shape that its cage gives.

    Attributes:
        distance: distance at the middle of the worst edge, mm.
        place: (3,) this place in the bent shape, mm.
    """

    distance: float
    place: FloatArray


def chord_error(
    mesh: TriangleMesh,
    bent: TriangleMesh,
    box: ArrayLike,
    resolution: Resolution,
    points: ArrayLike,
) -> ChordError:
    """Return the largest distance of the middles of long edges from their exact deformed positions.

    The cage moves vertices only; between them a mesh stays straight.

    Args:
        mesh: the mesh at rest, mm, with faces.
        box: (2, 3) lower and upper corner of the cage, mm.
        resolution: number of its points along x, y, z.
        points: (nx * ny * nz, 3) its control points, mm.
    """
    edges = _longest.get(mesh)
    if edges is None:
        edges = _longest.setdefault(mesh, _longest_edges(mesh))
    middles = mesh.vertices[edges].mean(axis=1)
    wanted = deform(cage_weights(middles, box, resolution), points)
    off = np.linalg.norm(bent.vertices[edges].mean(axis=1) - wanted, axis=1)
    worst = int(np.argmax(off))
    return ChordError(float(off[worst]), wanted[worst])


def _longest_edges(mesh: TriangleMesh) -> NDArray[np.int32]:
    ends = mesh.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    squares = ((mesh.vertices[ends[:, 0]] - mesh.vertices[ends[:, 1]]) ** 2).sum(axis=1)
    count = min(LONGEST_EDGES, len(ends))
    return np.asarray(ends[np.argpartition(-squares, count - 1)[:count]])
