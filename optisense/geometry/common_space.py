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
    return thick_place(as_manifold(first) ^ as_manifold(second), thinnest)


def thick_place(common: Any, thinnest: float) -> FloatArray | None:
    """The middle of a piece of a common space that is thicker than a contact.

    Args:
        common: of manifold3d.
        thinnest: mm, twice the volume of a piece over its surface.

    Returns:
        (3,) mm; None where all pieces are thinner.
    """
    for piece in common.decompose():
        if 2.0 * piece.volume() > thinnest * piece.surface_area():
            box = np.array(piece.bounding_box(), dtype=np.float64)
            return 0.5 * (box[:3] + box[3:])
    return None


def as_manifold(mesh: TriangleMesh) -> Any:
    """A mesh as manifold3d has it; empty, and its status says why, where it is no clean volume."""
    import manifold3d

    welded = mesh.welded()
    return manifold3d.Manifold(manifold3d.Mesh64(welded.vertices, welded.faces.astype(np.uint64)))
