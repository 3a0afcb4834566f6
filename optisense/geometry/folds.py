"""Defects of bent meshes: folds, faces that cut through each other, and too large triangles."""

from __future__ import annotations

import weakref
from typing import Literal, NamedTuple

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray

from optisense.array_types import FloatArray
from optisense.geometry.cage import (
    Resolution,
    cage_weights,
    deform,
    is_one_to_one,
    jacobians,
)
from optisense.geometry.crossings import self_crossings
from optisense.geometry.mesh import TriangleMesh

COLLAPSED = 1e-6
"""Share of its area at rest below which a face has collapsed: its sides are then a thousandth of
what they were, or its corners lie on one line."""

LONGEST_EDGES = 64
"""Number of edges whose deviation is measured: the longest ones of a mesh, as the deviation grows
as the square of the length."""

_longest: weakref.WeakKeyDictionary[TriangleMesh, NDArray[np.int32]] = weakref.WeakKeyDictionary()
_entangled: weakref.WeakKeyDictionary[TriangleMesh, bool] = weakref.WeakKeyDictionary()
_outlines: weakref.WeakKeyDictionary[TriangleMesh, NDArray[np.int64]] = weakref.WeakKeyDictionary()


class Fold(NamedTuple):
    """A defect of a bent mesh.

    Attributes:
        kind: "inside out" (the cage turns space over), "collapsed" (faces without area left) or
            "through itself" (faces that cut through each other).
        place: (3,) place in the bent shape, mm.
        vertex: number of the nearest vertex.
        affected: number of affected vertices or faces.
    """

    kind: Literal["inside out", "collapsed", "through itself"]
    place: FloatArray
    vertex: int
    affected: int


def find_fold(
    mesh: TriangleMesh,
    bent: TriangleMesh,
    box: ArrayLike,
    resolution: Resolution,
    points: ArrayLike,
) -> Fold | None:
    """Return the defect of a mesh bent by its cage, or None if it has none.

    The fast tests come first. A cage that is certainly one to one (`is_one_to_one`) cannot fold
    anything; a sheet that is in full view from one side (`is_in_full_view`) is not folded,
    regardless of the cage's effect on the space beside it. Otherwise a closed mesh must have
    positive Jacobian determinants at its vertices, a sheet must not be mirrored so that it faces
    its other side, and no mesh may cut through itself.

    Args:
        mesh: the mesh at rest, mm.
        box, resolution, points: the cage; see `optisense.geometry.cage.deformed`.
    """
    vanished = bent.face_areas <= COLLAPSED * mesh.face_areas
    vanished &= mesh.face_areas > 0.0
    if vanished.any():
        vertex = int(bent.faces[np.argmax(vanished), 0])
        return Fold("collapsed", bent.vertices[vertex], vertex, int(vanished.sum()))
    if is_one_to_one(box, resolution, points):
        return None
    in_view = not mesh.is_closed and is_in_full_view(mesh, bent)
    if in_view and mesh.face_vectors.sum(axis=0) @ bent.face_vectors.sum(axis=0) >= 0.0:
        return None
    if mesh.is_closed or in_view:
        stretch = np.linalg.det(jacobians(mesh.vertices, box, resolution, points))
        turned = stretch <= 0.0
        # A rotation in space also changes the direction that a sheet faces, but keeps the
        # determinants positive; those of a mirror image are negative.
        inside_out = turned.any() if mesh.is_closed else (stretch < 0.0).all()
        if inside_out:
            vertex = int(np.argmin(stretch))
            return Fold("inside out", bent.vertices[vertex], vertex, int(turned.sum()))
        if in_view:
            return None
    crossed = self_crossings(bent.welded())
    # A part at rest may consist of shells that cut through each other.
    if len(crossed.pairs) and not _is_entangled(mesh):
        place = crossed.places[0]
        vertex = int(np.argmin(np.linalg.norm(bent.vertices - place, axis=1)))
        return Fold("through itself", place, vertex, len(crossed.pairs))
    return None


def _is_entangled(mesh: TriangleMesh) -> bool:
    """Return whether a mesh at rest cuts through itself; cached for the next call."""
    entangled = _entangled.get(mesh)
    if entangled is None:
        found = self_crossings(mesh.welded(), limit=1)
        entangled = _entangled[mesh] = len(found.pairs) > 0
    return entangled


def is_in_full_view(mesh: TriangleMesh, bent: TriangleMesh) -> bool:
    """Return whether every point of an open sheet without holes is visible from one distant
    viewpoint.

    Seen against its mean normal, all faces show the same side and the outline does not cross
    itself; a flat map with these two properties covers each point once. The sheet therefore has no
    folds and does not touch itself. False means that this test is not conclusive. The outline of
    the sheet at rest is kept for the next call.
    """
    outline = _outlines.get(mesh)
    if outline is None:
        outline = _outlines[mesh] = _single_outline(mesh)
    if len(outline) == 0:
        return False
    normal = bent.face_vectors.sum(axis=0)
    length = np.linalg.norm(normal)
    if not length > 0.0 or (bent.face_vectors @ (normal / length) <= 0.0).any():
        return False
    across = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    frame = np.column_stack([across, np.cross(normal, across)])
    flat = bent.vertices[outline] @ (frame / np.linalg.norm(frame, axis=0))
    return bool(shapely.LinearRing(flat).is_simple)


def _single_outline(mesh: TriangleMesh) -> NDArray[np.int64]:
    """Return the boundary vertices, in order, of a sheet that is a disc; empty for others."""
    none = np.zeros(0, dtype=np.int64)
    faces = mesh.faces.astype(np.int64)
    size = len(mesh.vertices)
    starts, ends = faces.reshape(-1), np.roll(faces, -1, axis=1).reshape(-1)
    forward = np.sort(starts * size + ends)
    backward = np.sort(ends * size + starts)
    open_edges = np.setdiff1d(forward, backward, assume_unique=True)
    edges = len(np.unique(np.minimum(starts, ends) * size + np.maximum(starts, ends)))
    corners = len(np.unique(faces))
    if len(np.unique(forward)) < len(forward) or corners - edges + len(faces) != 1:
        return none
    follow = dict(zip((open_edges // size).tolist(), (open_edges % size).tolist(), strict=True))
    if len(follow) < len(open_edges) or not follow:
        return none
    first = here = next(iter(follow))
    outline = [first]
    while (here := follow.get(here, first)) != first:
        outline.append(here)
        if len(outline) > len(follow):
            return none
    return np.array(outline, dtype=np.int64) if len(outline) == len(follow) else none


def chord_error(
    mesh: TriangleMesh,
    bent: TriangleMesh,
    box: ArrayLike,
    resolution: Resolution,
    points: ArrayLike,
) -> tuple[float, FloatArray]:
    """Return the largest distance (mm) of a bent mesh from the exact shape that its cage gives, and
    the place (3,), mm, of the exact shape there.

    The cage moves vertices only; between them a mesh stays straight. The distance is measured at
    the middles of long edges. The arguments are those of `find_fold`.
    """
    edges = _longest.get(mesh)
    if edges is None:
        edges = _longest.setdefault(mesh, _longest_edges(mesh))
    middles = mesh.vertices[edges].mean(axis=1)
    wanted = deform(cage_weights(middles, box, resolution), points)
    off = np.linalg.norm(bent.vertices[edges].mean(axis=1) - wanted, axis=1)
    worst = int(np.argmax(off))
    return float(off[worst]), wanted[worst]


def _longest_edges(mesh: TriangleMesh) -> NDArray[np.int32]:
    ends = mesh.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    squares = ((mesh.vertices[ends[:, 0]] - mesh.vertices[ends[:, 1]]) ** 2).sum(axis=1)
    count = min(LONGEST_EDGES, len(ends))
    return np.asarray(ends[np.argpartition(-squares, count - 1)[:count]])
