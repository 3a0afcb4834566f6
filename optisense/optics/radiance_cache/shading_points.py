"""Visible points, and where each of them reads the radiance cache."""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi

from optisense.optics.backend.sequences import in_series
from optisense.optics.scene.bsdf import CoatingBsdf
from optisense.optics.scene.surface_cells import SurfaceCells, cell_at, plane_of
from optisense.optics.transport.camera_paths import VisiblePoints


@dataclass
class ShadingPoints:
    """Visible points that are to be shaded.

    Attributes:
        seen: the visible points.
        coating: what they are coated with.
        start: mm, where shadow rays from them start.
        cell: the cell where each reads the cache.
        shift: mm, from the point to the place that lies in this cell.
        active: which points count.
        raised: which points lie on an indenter.
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
    """A random cell next to points, the shift that led there, and whether there is one.

    It is the same for all bins, as light that straddles two bins must not be counted twice. Over
    the samples of a pixel, which are spread evenly, this interpolates between cells.
    """
    home, found = cell_at(cells, base, active)
    upright, _ = plane_of(cells, home, found)
    shift = mi.Vector3f(*(in_series(series, number, 1 + k) for k in range(3)))
    shift = (shift - 0.5) * dr.rcp(cells.inverse_size)
    shift -= upright * dr.dot(upright, shift)
    beside, exists = cell_at(cells, base + shift, found)
    return dr.select(exists, beside, home), shift, found
