"""The bodies of which a closed mesh consists."""

from __future__ import annotations

from typing import Any

import numpy as np

from optisense.geometry.coincidence import boxes_overlap
from optisense.geometry.common_space import as_manifold, of_manifold, thick_place
from optisense.geometry.containment import inside
from optisense.geometry.mesh import TriangleMesh
from optisense.geometry.overlaps import CONTACT
from optisense.geometry.patches import patches


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
    """Return a closed mesh in which bodies that share space are one body.

    Bodies that only touch stay apart. The mesh itself is returned if none share space.

    Args:
        mesh: closed mesh whose bodies have outward normals, mm.
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
