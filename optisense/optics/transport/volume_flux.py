"""Light on its way through the first millimetre above a surface.

What an indenter raises into the gel catches light that would pass over the undeformed surface, or
land on it far behind. How much there is, photons tell that cross a slab of this height: the length
of their way within it, over its volume, is the flux density across the light. Each segment of a
photon's path is looked at in a few random places.
"""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np

from optisense.optics.backend.arrays import floats
from optisense.optics.scene.ray_scene import Hit
from optisense.optics.scene.surface_cells import SurfaceCells, cell_at, plane_of

HEIGHT = 1.0
"""mm, of the slab."""
FARTHEST = 50.0
"""mm that light without anything in its way is followed."""
PIECES = 4
"""In which a segment of a photon's path is looked at, each at one place."""
GOLDEN = 0.618034
"""By which the places within pieces differ, so that they lie evenly in the mean of few."""
TAIL = 1.5
"""Of the slab's height: how far above the surface the end of a path begins that lands there."""
LEAST_COSINE = 1e-3


@dataclass
class Slab:
    """The slab above ``cells``; ``centres`` are four floats a cell: the middle of its surface."""

    cells: SurfaceCells
    centres: mi.Float


def slab_above(cells: SurfaceCells) -> Slab:
    """The slab above a surface."""
    four = np.zeros((cells.cells, 4), dtype=np.float32)
    four[:, :3] = cells.centres
    return Slab(cells, floats(four))


def above_cell(
    slab: Slab, point: mi.Point3f, active: mi.Bool
) -> tuple[mi.UInt32, mi.Float, mi.Bool]:
    """The cell that points lie above, how high (mm), and whether they are in the slab."""
    cells = slab.cells
    near, found = cell_at(cells, point, active)
    normal, offset = plane_of(cells, near, found)
    foot = point - normal * (dr.dot(normal, point) - offset)
    cell, found = cell_at(cells, foot, found)
    normal, offset = plane_of(cells, cell, found)
    height = dr.dot(normal, point) - offset
    # Beyond the surface's edge the nearest cell is found, too.
    middle = dr.gather(mi.Vector4f, slab.centres, cell, found)
    aside = foot - mi.Point3f(middle.x, middle.y, middle.z)
    size = dr.rcp(cells.inverse_size)
    beside = dr.maximum(dr.maximum(dr.abs(aside.x), dr.abs(aside.y)), dr.abs(aside.z))
    return cell, height, found & (height > 0) & (height < HEIGHT) & (beside < size)


def crossing(
    slab: Slab,
    hit: Hit,
    origin: mi.Point3f,
    direction: mi.Vector3f,
    chance: mi.Float,
    piece: mi.UInt32,
    landing: mi.Bool,
) -> tuple[mi.Point3f, mi.Float, mi.Bool]:
    """A random place on one of the ``PIECES`` of the way of light to where it hits.

    Half of them are of its end, where light that is ``landing`` is near the surface. ``chance`` is
    even over 0..1, one for all pieces of a way.

    Returns:
        The place; the slab's height over the length of the piece (as the cosine of a landing is
        that of a slab over the way through it); whether it is in the slab.
    """
    end = dr.select(hit.valid, hit.distance, FARTHEST)
    cosine = dr.maximum(dr.abs(dr.dot(direction, hit.normal)), LEAST_COSINE)
    tail = dr.select(landing, dr.minimum(TAIL * HEIGHT / cosine, end * 0.5), end * 0.5)
    last = piece >= PIECES // 2
    length = dr.select(last, tail, end - tail) * (2 / PIECES)
    first = dr.select(last, end - tail, 0) + length * mi.Float(piece % (PIECES // 2))
    place = chance + mi.Float(piece) * GOLDEN
    spot = origin + direction * (first + length * (place - dr.floor(place)))
    _, _, inside = above_cell(slab, mi.Point3f(spot), mi.Bool(True))
    return mi.Point3f(spot), HEIGHT / length, inside
