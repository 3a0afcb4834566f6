"""Closed meshes as solids: the space that two share, what one leaves of another, and bodies."""

from __future__ import annotations

import weakref
from typing import Any

import numpy as np

from optisense.array_types import FloatArray
from optisense.geometry._grid_welding import WELD_DISTANCE, distinct
from optisense.geometry.coincidence import boxes_overlap
from optisense.geometry.containment import inside
from optisense.geometry.mesh import TriangleMesh
from optisense.geometry.overlaps import CONTACT, find_overlap
from optisense.geometry.patches import patches
from optisense.geometry.shading_normals import shaded

Places = weakref.WeakKeyDictionary[TriangleMesh, FloatArray | None]
Rests = weakref.WeakKeyDictionary[TriangleMesh, TriangleMesh | None]

_places: weakref.WeakKeyDictionary[TriangleMesh, Places] = weakref.WeakKeyDictionary()
_rests: weakref.WeakKeyDictionary[TriangleMesh, Rests] = weakref.WeakKeyDictionary()


def common_space(first: TriangleMesh, second: TriangleMesh) -> FloatArray | None:
    """Return the middle (3,), mm, of a space that two closed meshes share; None if they share none,
    or if one is not a valid volume.

    Facets of two parts that touch overlap slightly. A common space counts if its mean thickness,
    twice its volume over its surface, is larger than `CONTACT`. The result is kept for the next
    call with the same meshes.
    """
    beside = _places.setdefault(first, weakref.WeakKeyDictionary())
    if second not in beside:
        meet = find_overlap(first, second) is not None
        common = as_manifold(first) ^ as_manifold(second) if meet else None
        beside[second] = None if common is None else thick_place(common, CONTACT)
    return beside[second]


def thick_place(common: Any, thinnest: float) -> FloatArray | None:
    """Return the middle (3,), mm, of a piece of a common space, a manifold3d object, whose mean
    thickness (twice the volume over the surface) is above `thinnest`, mm; None if there is none.
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


def cut_out(mesh: TriangleMesh, tool: TriangleMesh) -> TriangleMesh:
    """Return a closed mesh without the space that it shares with another one; nothing may be left.

    Shading normals are those of the whole mesh, as in `coincidence.cut`; faces of the cut have
    those of the other one.
    """
    first, second = shaded(mesh), shaded(tool)
    assert first.normals is not None and second.normals is not None
    solid = _with_properties(first, first.normals) - _with_properties(second, -second.normals)
    cut = solid.to_mesh64()
    vertices, normals = np.split(np.asarray(cut.vert_properties), [3], axis=1)
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = normals / np.maximum(length, np.finfo(np.float64).tiny)
    return TriangleMesh(vertices, np.asarray(cut.tri_verts), normals)


def _with_properties(mesh: TriangleMesh, properties: FloatArray) -> Any:
    """Return a mesh as a manifold3d object that interpolates properties (n, k) of its vertices,
    which may differ where these coincide.
    """
    import manifold3d

    first, number = distinct(mesh.vertices, WELD_DISTANCE)
    same = first[number]
    again = np.flatnonzero(same != np.arange(len(same))).astype(np.uint64)
    merged = same[mesh.faces]
    whole = (merged != np.roll(merged, 1, axis=1)).all(axis=1)
    return manifold3d.Manifold(
        manifold3d.Mesh64(
            np.hstack([mesh.vertices, properties]),
            mesh.faces[whole].astype(np.uint64),
            merge_from_vert=again,
            merge_to_vert=same[again].astype(np.uint64),
        )
    )


def without(first: TriangleMesh, second: TriangleMesh) -> TriangleMesh:
    """Return a closed mesh without the space that it shares with another one, or the mesh itself if
    they share none or nothing would be left; kept for the next call with the same meshes.

    Unlike `common_space`, this also finds solids that share space without crossing each other's
    surfaces, as those with sides in one plane. Bodies of one solid may overlap.
    """
    beside = _rests.setdefault(first, weakref.WeakKeyDictionary())
    if second not in beside:
        beside[second] = _carved(first, second)
    rest = beside[second]
    return first if rest is None else rest


def _carved(first: TriangleMesh, second: TriangleMesh) -> TriangleMesh | None:
    if ((first.bounds[0] >= second.bounds[1]) | (first.bounds[1] <= second.bounds[0])).any():
        return None
    if thick_place(as_manifold(first) ^ as_manifold(second), CONTACT) is None:
        return None
    # A difference of solids that overlap themselves counts the space of two bodies twice.
    rest = as_manifold(united(first)) - as_manifold(united(second))
    return None if rest.is_empty() else of_manifold(rest)


def bodies(mesh: TriangleMesh) -> list[list[TriangleMesh]]:
    """Return the bodies of a closed mesh: for each its outside first, then its cavities.

    A cavity's normals point inward, so that its volume is subtracted from its body's; it belongs to
    the smallest body that contains all of it. Where its corners touch the outside of its body, this
    is the smallest one that contains the most of its vertices.
    """
    everything = np.arange(len(mesh.faces))
    pieces = [mesh.with_faces(mesh.faces[faces]).compacted() for faces in patches(mesh, everything)]
    return _grouped(pieces)


def _grouped(pieces: list[TriangleMesh]) -> list[list[TriangleMesh]]:
    """Return the bodies of closed pieces of a surface; see `bodies`."""
    found = [[piece] for piece in sorted(pieces, key=lambda p: p.volume) if piece.volume > 0.0]
    for cavity in (piece for piece in pieces if piece.volume <= 0.0):
        contained = [int(inside(cavity.vertices, body[0]).sum()) for body in found]
        if any(contained):
            found[int(np.argmax(contained))].append(cavity)
    return found


def united(mesh: TriangleMesh) -> TriangleMesh:
    """Return a closed mesh, whose bodies have outward normals, with bodies that share space as one.

    Bodies that only touch stay apart. The mesh itself is returned if none share space.
    """
    # Other than patches, pieces of a manifold are apart where bodies meet in an edge.
    pieces = [of_manifold(piece) for piece in as_manifold(mesh).decompose()]
    found = [TriangleMesh.joined(body) for body in _grouped(pieces)]
    pairs = [(one, other) for k, one in enumerate(found) for other in found[:k]]
    if not any(boxes_overlap(one, other, CONTACT) for one, other in pairs):
        return mesh
    solids = [as_manifold(body) for body in found]
    apart: list[Any] = []
    for solid in solids:
        others, apart = apart, []
        for other in others:
            if thick_place(solid ^ other, CONTACT) is None:
                apart.append(other)
            else:
                solid += other
        apart.append(solid)
    if len(apart) == len(solids):
        return mesh
    return TriangleMesh.joined([of_manifold(solid) for solid in apart]).welded()
