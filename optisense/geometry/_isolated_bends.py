"""Bends between flat faces that belong to no curved surface, such as the ridge of a roof prism.

Facets of a curved surface bend again, to the same side and by a similar angle, at an edge beyond
their neighbour. A bend between two flat faces that is not repeated in this way is a sharp edge,
even if it is as weak as those between the facets of a curved surface.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from optisense.array_types import BoolArray, FloatArray, IntArray
from optisense.geometry.connected import connected_components
from optisense.geometry.patches import inner_edges

if TYPE_CHECKING:
    from optisense.geometry.mesh import TriangleMesh

FLAT = 0.003
"""Angle (degrees) between neighbouring triangles up to which they belong to one flat face: the
rounding of coordinates to 1e-5 mm in triangles of 0.2 mm. Triangles of an irregular mesh of a
curved surface hardly ever lie in one plane this exactly."""

LEAST = 1.0
"""Smallest bend (degrees) that can be sharp. Averaged normals at weaker ones are off by half a
degree at most, and facets of fine meshes bend by less."""

WEAKER = 4.0
"""Largest ratio of a bend to the one that repeats it. Where a fillet begins on a flat face, bends
are half of the others, and near an inflection they decrease by a factor of up to 3; any stronger
bend also repeats a weaker one."""

LARGER = 3.0
"""Ratio of areas above which a flat face between two smaller ones is not a facet of the curve
through them, but a face with a bevel at either side."""


def divide_at_isolated_bends(
    mesh: TriangleMesh, crease: float
) -> tuple[NDArray[np.integer], NDArray[np.integer]]:
    """Divide the vertices of a mesh along isolated bends.

    Only bends between faces of two triangles or more are considered, as single triangles may belong
    to any surface.

    Args:
        mesh: the mesh, whose faces are connected where they share vertices.
        crease: angle (degrees) above which all edges are sharp.

    Returns:
        Faces (m, 3) of the divided vertices, and the old number (k,) of each of these.
    """
    own = np.arange(len(mesh.vertices))
    edges, pairs = inner_edges(mesh)
    one, other = pairs.T
    normals = mesh.face_normals
    cosine = np.einsum("ij,ij->i", normals[one], normals[other])
    smooth = cosine >= np.cos(np.radians(crease))
    flat = cosine > np.cos(np.radians(FLAT))
    several = np.zeros(len(mesh.faces), dtype=bool)
    several[pairs[flat]] = True
    possible = smooth & (cosine < np.cos(np.radians(LEAST))) & several[one] & several[other]
    if not possible.any():
        return mesh.faces, own
    bent = np.flatnonzero(smooth & (cosine < np.cos(np.radians(LEAST / WEAKER))))
    patch = connected_components(len(mesh.faces), one[flat], other[flat])
    isolated = ~_repeated(mesh, pairs[bent], patch, np.degrees(np.arccos(cosine[bent])))
    sharp = bent[possible[bent] & (patch[one[bent]] != patch[other[bent]]) & isolated]
    if not len(sharp):
        return mesh.faces, own
    smooth[sharp] = False
    # The corners at the ends of sharp edges remain one vertex where smooth edges connect them.
    touched = np.zeros(len(own), dtype=bool)
    touched[edges[sharp]] = True
    faces = mesh.faces.astype(np.int64)
    corners = np.flatnonzero(touched[faces])
    number = np.full(faces.size, -1)
    number[corners] = np.arange(len(corners))
    links = [
        number[3 * pairs[near] + (faces[pairs[near]] == end[near, None, None]).argmax(axis=2)]
        for end in edges.T
        for near in [smooth & touched[end]]
    ]
    group = connected_components(len(corners), *np.concatenate(links).T)
    _, first = np.unique(group, return_index=True)
    old = faces.ravel()[corners[first]]
    faces.ravel()[corners] = len(own) + group
    return faces, np.concatenate([own, old])


def _repeated(mesh: TriangleMesh, pairs: IntArray, patch: IntArray, angle: FloatArray) -> BoolArray:
    """Return whether each bend (k,), by its two triangles ``pairs`` (k, 2) and its angle (k,),
    degrees, is repeated across one of the flat faces beside it; ``patch`` (m,) numbers these.
    """
    middle = mesh.triangles.sum(axis=1)  # three times the centre, as only the side counts
    across = middle[pairs[:, 1]] - middle[pairs[:, 0]]
    convex = np.einsum("ij,ij->i", across, mesh.face_normals[pairs[:, 0]]) < 0
    # Each bend counts once for the face at either side of it.
    beside = patch[pairs]
    face, neighbour = beside.ravel("F"), beside[:, ::-1].ravel("F")
    kind, strength = 2 * face + np.tile(convex, 2), np.tile(np.log(angle), 2)
    # Ordered by kind, then by strength: logarithms of degrees are within -8 and 8.
    key = 16.0 * kind + strength
    order = np.argsort(key)
    face, neighbour, kind, key = face[order], neighbour[order], kind[order], key[order]
    first = np.searchsorted(key, key - np.log(WEAKER))
    end = np.searchsorted(kind, kind, "right")
    area = np.bincount(patch, mesh.face_areas)
    similar = area[neighbour] * LARGER >= area[face]
    counts = np.concatenate([[0], np.cumsum(similar)])
    changes = np.concatenate([[0], np.cumsum(neighbour[1:] != neighbour[:-1])])
    repeated = np.empty(len(key), dtype=bool)
    # A neighbour that is much smaller needs a larger one at the other side.
    repeated[order] = np.where(
        similar, changes[end - 1] > changes[first], counts[end] > counts[first]
    )
    return np.asarray(repeated.reshape(2, -1).any(axis=0))
