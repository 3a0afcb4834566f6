"""The raised plane: light that passes through a plane above a flat surface.

A direction bin is looked up where the line along its middle direction, through a point on an
indenter, meets the undeformed surface. Near a lamp this is several millimetres away, so that the
width of the bin and the blur of the smoothing shift the light by a millimetre. Photons are
therefore also tallied where they cross a plane above the surface, each along its own direction.
Points between both planes look up either of them, at random in proportion to the distance from the
other. What a bin's width shifts one way in the one plane, it shifts the other way in the other, and
the mean of many camera samples is right to first order.
"""

from __future__ import annotations

import drjit as dr
import mitsuba as mi

from optisense.optics.backend.sequences import GOLDEN_BITS, unit_float
from optisense.optics.scene.surface_cells import SurfaceCells, cell_at, plane_of
from optisense.optics.transport.camera_paths import VisiblePoints

RAISED_HEIGHT = 0.8
"""Height (mm) of the raised plane, about the depth of usual contacts. In a contact of this depth
near the lamps of GelSight Mini, means over patches are 3.0 % off; with 0.5 mm it is 3.5 %, and with
1.1 mm 4.3 %. A third plane at 0.4 mm makes no difference."""
MIN_COSINE = 0.02
"""Cosine of incidence below which a photon is not tallied in the raised plane, as the place where
it crosses it is too uncertain."""


def crossed_cell(
    cells: SurfaceCells,
    cell: mi.UInt32,
    point: mi.Point3f,
    direction: mi.Vector3f,
    active: mi.Bool,
) -> tuple[mi.UInt32, mi.Bool]:
    """Return the cell below the place where each photon crosses the raised plane, and whether there
    is one.

    Args:
        cells: the cells of a flat surface.
        cell: the cell that each photon lands in.
        point: where it lands, mm.
        direction: unit vector along which it travels.
        active: mask of the photons that land in a cell.
    """
    normal, offset = plane_of(cells, cell, active)
    cosine = -dr.dot(normal, direction)
    crosses = active & (cosine > MIN_COSINE)
    way = (RAISED_HEIGHT + offset - dr.dot(normal, point)) / dr.maximum(cosine, MIN_COSINE)
    return cell_at(cells, point - direction * way - normal * RAISED_HEIGHT, crosses)


def sampled_plane(points: VisiblePoints, rise: mi.Float, raised: mi.Bool) -> mi.Bool:
    """Return whether each camera sample looks up the raised plane instead of the surface.

    Args:
        points: the visible points.
        rise: their heights (mm) above the undeformed surface.
        raised: mask of the points that lie on an indenter.
    """
    shift = mi.sample_tea_32(points.series, mi.UInt32(5), 4)[0]
    return raised & (unit_float(points.number * GOLDEN_BITS + shift) * RAISED_HEIGHT < rise)
