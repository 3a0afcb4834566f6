"""Convex bodies for the contacts of a sensor: the hull of each solid part, cut where it would cover
the skin.

Physics engines press convex bodies against each other. The hull of a housing with a window would
close the window, so that objects would touch the hull instead of the gel. Such a part is cut along
the faces of a box around the skin, and the hulls of its pieces leave the skin free.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from optisense.array_types import FloatArray
from optisense.geometry.solids import of_manifold

COVERED = 0.05
"""Depth (mm) in a hull from which on a point of the skin counts as covered: more than the gap
between the triangles of parts that touch (0.002 mm), and less than the depth of any contact."""

LEAST_PIECE = 0.1
"""Volume (mm^3) below which a piece of a part is left out: that of a cube of 0.5 mm, which no
object touches before its neighbours."""

MOST_CUTS = 4
"""Number of times that a gel is halved, into 16 bodies at most for the physics engine."""


def depth_in(points: FloatArray, hull: ConvexHull) -> FloatArray:
    """Return the depths (n,), mm, of points (n, 3) in a convex hull, below 0 outside of it."""
    normals, offsets = hull.equations[:, :3], hull.equations[:, 3]
    return np.asarray(-(points @ normals.T + offsets).max(axis=1))


def free_hulls(part: Any, skin: FloatArray) -> tuple[list[Any], bool]:
    """Return the convex hulls of a part, or of the pieces of it, that do not cover the vertices (n,
    3) of the skin, mm, and whether a piece is left out because it would cover the skin in any case.

    Part and hulls are objects of type `manifold3d.Manifold`.
    """
    if not _covers(part, skin):
        return [part.hull()], False
    low, high = skin.min(axis=0), skin.max(axis=0)
    pieces, rest = [], part
    for axis in range(3):
        for sign, limit in ((1.0, high[axis]), (-1.0, low[axis])):
            normal = [0.0, 0.0, 0.0]
            normal[axis] = sign
            beyond, rest = rest.split_by_plane(normal, sign * float(limit))
            pieces.append(beyond)
    pieces.append(rest)
    kept = [piece for whole in pieces for piece in whole.decompose()]
    kept = [piece for piece in kept if piece.volume() > LEAST_PIECE]
    free = [piece.hull() for piece in kept if not _covers(piece, skin)]
    return free, len(free) < len(kept)


def gel_hulls(gel: Any, skin: FloatArray, cuts: int = MOST_CUTS) -> list[Any]:
    """Return the convex hulls of a gel, or of slices of it where a hull would cover the vertices
    (n, 3) of the skin, mm; a slice is cut again up to some number of times.
    """
    if cuts == 0 or not _covers(gel, skin):
        return [gel.hull()]
    low, high = np.array(gel.bounding_box()).reshape(2, 3)
    axis = int(np.argmax(high - low))
    normal = np.eye(3)[axis].tolist()
    halves = gel.split_by_plane(normal, float(low[axis] + high[axis]) / 2.0)
    return [hull for half in halves for hull in gel_hulls(half, skin, cuts - 1)]


def _covers(part: Any, skin: FloatArray) -> bool:
    """Return whether the convex hull of a part covers any of the skin."""
    try:
        hull = ConvexHull(of_manifold(part.hull()).vertices)
    except QhullError:  # flat
        return False
    return bool((depth_in(skin, hull) > COVERED).any())
