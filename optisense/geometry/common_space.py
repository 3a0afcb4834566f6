"""The space that two closed meshes share."""

from __future__ import annotations

import weakref
from typing import Any

import numpy as np

from optisense.geometry.meeting import find_meeting
from optisense.geometry.mesh import FloatArray, TriangleMesh

Places = weakref.WeakKeyDictionary[TriangleMesh, FloatArray | None]

_known: weakref.WeakKeyDictionary[TriangleMesh, Places] = weakref.WeakKeyDictionary()


def common_space(first: TriangleMesh, second: TriangleMesh, thinnest: float) -> FloatArray | None:
    """The middle of a space that two solids share; kept for the next call with the same two.

    Facets of two parts that touch reach into each other by a little. A common space counts where
    it is on average thicker than that: twice its volume over its surface.

    Args:
        first, second: closed, mm.
        thinnest: mm; thinner ones do not count.

    Returns:
        (3,) mm; None where they share none, or where a mesh is no clean volume.
    """
    beside = _known.setdefault(first, weakref.WeakKeyDictionary())
    if second not in beside:
        beside[second] = _found(first, second, thinnest)
    return beside[second]


def _found(first: TriangleMesh, second: TriangleMesh, thinnest: float) -> FloatArray | None:
    if find_meeting(first, second) is None:
        return None
    for piece in (_manifold(first) ^ _manifold(second)).decompose():
        if 2.0 * piece.volume() > thinnest * piece.surface_area():
            box = np.array(piece.bounding_box(), dtype=np.float64)
            return 0.5 * (box[:3] + box[3:])
    return None


def _manifold(mesh: TriangleMesh) -> Any:
    """As manifold3d has it; empty where the mesh is no clean volume."""
    import manifold3d

    welded = mesh.welded()
    return manifold3d.Manifold(manifold3d.Mesh64(welded.vertices, welded.faces.astype(np.uint64)))
