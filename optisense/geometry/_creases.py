"""Creases between flat faces, such as the ridge of a roof prism.

The edges between the facets of a curved surface bend alike: across a facet lies another edge,
roughly parallel to the first, that bends to the same side with similar curvature. An edge between
two flat faces without such another one is a crease, even if its dihedral angle is as small as those
between the facets of a curved surface.

The curvature at an edge is its dihedral angle divided by the width of the narrower face, and the
width of a face is its area divided by the length of the edge.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from optisense.array_types import BoolArray, FloatArray, IntArray
from optisense.geometry._grid_welding import WELD_DISTANCE, distinct
from optisense.geometry.connected import connected_components
from optisense.geometry.patches import inner_edges
from optisense.geometry.shading_normals import CREASE, SAME_NORMAL

if TYPE_CHECKING:
    from optisense.geometry.mesh import TriangleMesh

FLAT = 0.003
"""Angle (degrees) between neighbouring triangles up to which they belong to one flat face: the
rounding of coordinates to 1e-5 mm in triangles of 0.2 mm. Triangles of an irregular mesh of a
curved surface hardly ever lie in one plane this exactly."""

LEAST = 1.0
"""Smallest angle (degrees) of a crease. Averaged normals at weaker bends are off by half a degree
at most, and facets of fine meshes bend by less."""

SIMILAR = 8.0
"""Largest ratio of the curvatures of two edges of one curved surface. Where a fillet begins on a
flat face, curvature is half of that between its facets; between facets one of which is 12 times as
wide as the next, it varies by a factor of 6.5. The edge of a fillet or bevel of 0.5 mm has 50 times
the curvature of a bend between faces of 8 mm."""

PARALLEL = 45.0
"""Largest angle (degrees) between successive edges of one curved surface, as on a cone of eight
facets."""

WIDER = 3.0
"""Ratio of widths above which a face between two narrower ones is not a facet of the curve through
them, but a flat face with a bevel at either side."""


def divided_at_creases(
    mesh: TriangleMesh,
) -> tuple[NDArray[np.integer], NDArray[np.integer]]:
    """Divide the vertices of a mesh along its creases.

    Only edges between faces of two triangles or more can be creases, as single triangles may belong
    to any surface.

    Args:
        mesh: the mesh, whose faces are connected where they share vertices.

    Returns:
        Faces (m, 3) of the divided vertices, and the old number (k,) of each of these.
    """
    own = np.arange(len(mesh.vertices))
    edges, pairs = inner_edges(mesh)
    one, other = pairs.T
    normals = mesh.face_normals
    cosine = np.einsum("ij,ij->i", normals.take(one, axis=0), normals.take(other, axis=0))
    smooth = cosine >= np.cos(np.radians(CREASE))
    possible = np.flatnonzero(smooth & (cosine < np.cos(np.radians(LEAST))))
    if not len(possible):
        return mesh.faces, own
    flat = cosine > np.cos(np.radians(FLAT))
    several = np.zeros(len(mesh.faces), dtype=bool)
    several[pairs[flat]] = True
    possible = possible[several[pairs[possible]].all(axis=1)]
    if not len(possible):
        return mesh.faces, own
    patch = connected_components(len(mesh.faces), one[flat], other[flat])
    asked = np.zeros(len(mesh.faces), dtype=bool)
    asked[patch[pairs[possible]]] = True
    beside = asked[patch[one]] | asked[patch[other]]
    bent = np.flatnonzero(smooth & beside & (patch[one] != patch[other]))
    curved = _curved(mesh, edges[bent], pairs[bent], patch)
    crease = np.intersect1d(possible, bent[~curved])
    if not len(crease):
        return mesh.faces, own
    smooth[crease] = False
    # The corners at the ends of creases remain one vertex where smooth edges connect them.
    touched = np.zeros(len(own), dtype=bool)
    touched[edges[crease]] = True
    faces = np.array(mesh.faces, dtype=np.int64, order="C")
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


def divided_by_normals(
    mesh: TriangleMesh,
) -> tuple[NDArray[np.integer], NDArray[np.integer]]:
    """Divide the vertices of a mesh where its shading normals differ, and nowhere else.

    Args:
        mesh: a mesh with normals, whose faces need not share vertices.

    Returns:
        See `divided_at_creases`.
    """
    assert mesh.normals is not None
    corners = np.hstack([mesh.vertices / WELD_DISTANCE, mesh.normals / SAME_NORMAL])
    first, number = distinct(corners, 1.0)
    return number[mesh.faces], first


def _curved(
    mesh: TriangleMesh, edges: NDArray[np.integer], pairs: IntArray, patch: IntArray
) -> BoolArray:
    """Return whether each edge (k, 2) between two flat faces is one of a curved surface.

    Args:
        edges: the vertices (k, 2) of each edge.
        pairs: the triangles (k, 2) beside each edge.
        patch: the number (m,) of the flat face that each triangle belongs to.
    """
    normals, middle = mesh.face_normals, mesh.triangles.sum(axis=1)  # three times the centre
    one, other = pairs.T
    across = middle[other] - middle[one]
    convex = np.einsum("ij,ij->i", across, normals[one]) < 0
    # The edges between the same two faces, and to the same side, are parts of one.
    low, high = np.sort(patch[pairs], axis=1).T
    _, first, part = np.unique(
        (low * len(patch) + high) * 2 + convex, return_index=True, return_inverse=True
    )
    along = mesh.vertices[edges[:, 1]] - mesh.vertices[edges[:, 0]]
    length = np.bincount(part, np.linalg.norm(along, axis=1))
    beside = np.stack([low[first], high[first]], axis=1)
    sine = np.linalg.norm(np.cross(normals[one[first]], normals[other[first]]), axis=1)
    width = np.bincount(patch, mesh.face_areas)[beside] / length[:, None]
    curvature = np.arcsin(sine) / width.min(axis=1)
    # Each edge counts once for the face at either side of it. In the plane of that face, its
    # direction is an angle with a period of 180 degrees.
    face = beside.ravel("F")
    triangle = np.empty(len(patch), dtype=np.int64)
    triangle[patch] = np.arange(len(patch))  # one of each face, whose first side is the x axis
    triangle = triangle[face]
    x = mesh.triangles[triangle, 1] - mesh.triangles[triangle, 0]
    axes = np.cross(normals[triangle], x), x
    direction = np.tile(along[first], (2, 1))
    angle = np.arctan2(*(np.einsum("ij,ij->i", axis, direction) for axis in axes))
    points = np.column_stack(
        [
            4.0 * (2 * face + np.tile(convex[first], 2)),  # apart from those of other faces
            np.tile(np.log(curvature) / np.log(SIMILAR), 2),
            np.degrees(angle) % 180.0 / np.nextafter(PARALLEL, 180.0),  # below the period
        ]
    )
    narrow = (WIDER * width[:, ::-1] < width).ravel("F")
    from_one, from_other = _repeated(points, narrow).reshape(2, -1)
    return np.asarray((from_one | from_other)[part])


def _repeated(points: FloatArray, narrow: BoolArray) -> BoolArray:
    """Return whether near each point (k, 3) of an edge there is one of another edge: within 1 in
    each coordinate, the third of which is periodic. Of two edges to narrower neighbours, which
    ``narrow`` (k,) marks, neither repeats the other.
    """
    from scipy.spatial import cKDTree  # takes a tenth of a second to load

    period = [0.0, 0.0, 180.0 / PARALLEL]
    result = np.zeros(len(points), dtype=bool)
    for asked, others, number in ((~narrow, slice(None), 2), (narrow, ~narrow, 1)):
        if asked.any() and len(points[others]):
            tree = cKDTree(points[others], boxsize=period)
            away = tree.query(points[asked], [number], p=np.inf, distance_upper_bound=1.0)[0]
            result[asked] = np.isfinite(away[:, 0])
    return result
