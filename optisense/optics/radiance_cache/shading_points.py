"""Visible points, and the places where they read the radiance cache."""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi

from optisense.optics.backend.sequences import richtmyer
from optisense.optics.radiance_cache.cache import BinnedLight
from optisense.optics.scene.coating_bsdf import CoatingBsdf
from optisense.optics.scene.surface_cells import SurfaceCells, cell_at, plane_of
from optisense.optics.transport.camera_paths import VisiblePoints


@dataclass
class ShadingPoints:
    """Visible points that are to be shaded.

    Attributes:
        seen: the visible points.
        coating: the BSDF of their coating.
        start: origin (mm) of the shadow rays from each point.
        cell: number of the cell in which each point reads the cache.
        shift: vector (mm) from the point to the place that lies in this cell.
        active: mask of the points that count.
        raised: mask of the points that lie on an indenter.
    """

    seen: VisiblePoints
    coating: CoatingBsdf
    start: mi.Point3f
    cell: mi.UInt32
    shift: mi.Vector3f
    active: mi.Bool
    raised: mi.Bool


def interpolating_cell(
    cells: SurfaceCells,
    base: mi.Point3f,
    active: mi.Bool,
    series: mi.UInt32,
    number: mi.UInt32,
) -> tuple[mi.UInt32, mi.Vector3f, mi.Bool]:
    """Return a random cell (n,) next to each point, the shift (3, n), mm, that led there, and
    whether there is one (n,).

    All bins are read in the same cell, as light that straddles two bins must not be counted twice.
    Averaged over the samples of a pixel, which are spread evenly, this interpolates between cells.
    """
    home, found = cell_at(cells, base, active)
    upright, _ = plane_of(cells, home, found)
    shift = mi.Vector3f(*(richtmyer(series, number, 1 + k) for k in range(3)))
    shift = (shift - 0.5) * dr.rcp(cells.inverse_size)
    shift -= upright * dr.dot(upright, shift)
    beside, exists = cell_at(cells, base + shift, found)
    return dr.select(exists, beside, home), shift, found


def foot_of(cells: SurfaceCells, cell: mi.UInt32, point: mi.Point3f, active: mi.Bool) -> mi.Point3f:
    """Return the foot (3, n), mm, of the perpendicular from points to the planes of cells."""
    upright, offset = plane_of(cells, cell, active)
    return point - upright * (dr.dot(upright, point) - offset)


def may_be_cached(
    light: BinnedLight, cell: mi.UInt32, direction: mi.Vector3f, active: mi.Bool
) -> mi.Bool:
    """Return whether the cache may hold the light that arrives straight from other opaque places.

    The flux layer holds such light only where it falls towards the surface (`sample_segment`).

    Args:
        cell: the cell below each point that the light arrives at.
        direction: unit directions from the points to the places that the light comes from.
        active: mask of the points that count.
    """
    if light.above is None:
        return active
    return active & (dr.dot(plane_of(light.cells, cell, active)[0], direction) > 0)
