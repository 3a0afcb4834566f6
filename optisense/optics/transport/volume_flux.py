"""Volume flux: the light that passes through a thin layer above a surface.

An indenter that stands off the undeformed surface catches light that would pass over that surface,
or land on it far behind. The amount of this light is estimated from the photons that cross the
layer: the length of their paths within the layer over its volume is the flux density across the
light (a track-length estimator). Each segment of a photon's path is tested at a few random places.
"""

from __future__ import annotations

import drjit as dr
import mitsuba as mi

from optisense.optics.scene.ray_scene import Ray, SurfaceHit
from optisense.optics.scene.surface_cells import SurfaceCells, cell_at, plane_of

LAYER_HEIGHT = 1.0
"""Height (mm) of the layer; presses are usually less deep. It is lower on small sensing surfaces
(see `layer_height`)."""
MAX_SEGMENT_LENGTH = 50.0
"""Length (mm) at which a path segment that meets nothing is cut off: twice the size of a sensor,
so that it has left the layer."""
SAMPLES_PER_SEGMENT = 4
"""Number of pieces of a path segment; one random place of each is tested for lying in the layer."""
GOLDEN_RATIO_FRACTION = 0.618034
"""Offset (modulo 1) between the places within successive pieces. Multiples of the golden ratio's
fractional part are spread evenly for any number of pieces."""
TAIL_HEIGHTS = 1.5
"""Height above the surface, in units of `layer_height`, at which the last part of a landing
photon's path begins. Half of the pieces divide this part."""
MIN_COSINE = 1e-3
"""Lower bound on the cosine of incidence when the length of that last part is computed; it avoids
a division by zero, and the part is at most half of the segment in any case."""


def layer_height(cells: SurfaceCells) -> mi.Float:
    """Return the height (1,), mm, of the layer above cells."""
    return LAYER_HEIGHT * cells.fineness


def layer_cell_at(
    cells: SurfaceCells, point: mi.Point3f, active: mi.Bool
) -> tuple[mi.UInt32, mi.Float, mi.Bool]:
    """Return the number (n,) of the cell that each point lies above, its height (n,), mm, above the
    cell's plane, and whether it is in the layer (n,).
    """
    near, found = cell_at(cells, point, active)
    normal, offset = plane_of(cells, near, found)
    foot = point - normal * (dr.dot(normal, point) - offset)
    cell, found = cell_at(cells, foot, found)
    normal, offset = plane_of(cells, cell, found)
    height = dr.dot(normal, point) - offset
    # Beyond the surface's edge the nearest cell is found as well.
    middle = dr.gather(mi.Vector4f, cells.middles, cell, found)
    aside = foot - mi.Point3f(middle.x, middle.y, middle.z)
    size = dr.rcp(cells.inverse_size)
    beside = dr.maximum(dr.maximum(dr.abs(aside.x), dr.abs(aside.y)), dr.abs(aside.z))
    below = height < layer_height(cells)
    return cell, height, found & (height > 0) & below & (beside < size)


def sample_segment(
    cells: SurfaceCells,
    ray: Ray,
    hit: SurfaceHit,
    chance: mi.Float,
    piece: mi.UInt32,
    landing: mi.Bool,
    scattered: mi.Bool,
) -> tuple[mi.Point3f, mi.Float, mi.Bool]:
    """Return a random place (3, n) on one of the `SAMPLES_PER_SEGMENT` pieces of a path segment,
    tested for the layer above cells.

    Half of the pieces belong to the segment's end, where the light of a ``landing`` segment is near
    the surface.

    Args:
        chance: uniform random number from 0 to 1, the same for all pieces of a segment.
        piece: the number of the piece.
        landing: whether the segment ends on an opaque surface.
        scattered: whether it begins on the sensing surface. Near its start, such light is not in
            the layer: indenters get it by interreflection, as it does not vary with height there.

    Returns:
        The place (mm); the layer's height over the length of the piece, which replaces the cosine
        of incidence; and whether the place is in the layer.
    """
    end = dr.select(hit.valid, hit.distance, MAX_SEGMENT_LENGTH)
    cosine = dr.maximum(dr.abs(dr.dot(ray.direction, hit.normal)), MIN_COSINE)
    top = layer_height(cells)
    tail = dr.select(landing, dr.minimum(TAIL_HEIGHTS * top / cosine, end * 0.5), end * 0.5)
    last = piece >= SAMPLES_PER_SEGMENT // 2
    length = dr.select(last, tail, end - tail) * (2 / SAMPLES_PER_SEGMENT)
    first = dr.select(last, end - tail, 0) + length * mi.Float(piece % (SAMPLES_PER_SEGMENT // 2))
    place = chance + mi.Float(piece) * GOLDEN_RATIO_FRACTION
    spot = ray.origin + ray.direction * (first + length * (place - dr.floor(place)))
    cell, _, inside = layer_cell_at(cells, mi.Point3f(spot), mi.Bool(True))
    upright, _ = plane_of(cells, cell, inside)
    inside &= ~scattered | (dr.dot(upright, ray.direction) < 0)
    return mi.Point3f(spot), top / length, inside
