"""The space that two closed meshes share."""

from __future__ import annotations

import weakref
from typing import Any

import numpy as np

from optisense.array_types import FloatArray
from optisense.geometry.mesh import TriangleMesh
from optisense.geometry.overlaps import CONTACT, find_overlap

Places = weakref.WeakKeyDictionary[TriangleMesh, FloatArray | None]

_known: weakref.WeakKeyDictionary[TriangleMesh, Places] = weakref.WeakKeyDictionary()


def common_space(first: TriangleMesh, second: TriangleMesh) -> FloatArray | None:
    """Return the middle of a space that two solids share; cached for the next call with the same
    solids.

    Facets of two parts that touch overlap slightly. A common space counts if its mean thickness,
    twice its volume over its surface, is larger than `CONTACT`.

    Args:
        first, second: closed meshes, mm.

    Returns:
        The middle (3,), mm; None if they share no space, or if a mesh is not a valid volume.
    """
    beside = _known.setdefault(first, weakref.WeakKeyDictionary())
    if second not in beside:
        beside[second] = _found(first, second)
    return beside[second]


def _found(first: TriangleMesh, second: TriangleMesh) -> FloatArray | None:
    if find_overlap(first, second) is None:
        return None
    return thick_place(as_manifold(first) ^ as_manifold(second), CONTACT)


def thick_place(common: Any, thinnest: float) -> FloatArray | None:
    """Return the middle of a piece of a common space that is thicker than a contact.

    Args:
        common: the common space, a manifold3d object.
        thinnest: smallest mean thickness (twice the volume over the surface), mm.

    Returns:
        The middle (3,), mm; None if all pieces are thinner.
    """
    for piece in common.decompose():
        if 2.0 * piece.volume() > thinnest * piece.surface_area():
            box = np.array(piece.bounding_box(), dtype=np.float64)
            return 0.5 * (box[:3] + box[3:])
    return None


def as_manifold(mesh: TriangleMesh) -> Any:
    """Return a mesh as a manifold3d object; empty with a status if it is not a valid volume."""
    import manifold3d

    welded = mesh.welded()
    # manifold3d refuses arrays that are read-only, so both are copies.
    vertices = welded.vertices.copy()
    faces = welded.faces.astype(np.uint64)
    return manifold3d.Manifold(manifold3d.Mesh64(vertices, faces))


def of_manifold(solid: Any) -> TriangleMesh:
    """Return a manifold3d object as a mesh."""
    mesh = solid.to_mesh64()
    return TriangleMesh(np.asarray(mesh.vert_properties)[:, :3], np.asarray(mesh.tri_verts))
