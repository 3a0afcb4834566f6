"""The share of grazing light, estimated from the photons of the pilot pass."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from optisense.optics.backend.arrays import indices
from optisense.optics.scene.surface_cells import SurfaceCells, cell_at
from optisense.optics.transport.photon_map import PhotonMap

GRAZING_COSINE = 0.25
"""Cosine of incidence (76 degrees) below which light is grazing. Light that passes 1 mm above a
place at such angles lands 4 mm or more behind it, so that the landings at the place do not
represent it."""
MIN_COSINE = 0.02
"""Lower bound on the cosine of incidence (89 degrees) when powers are divided by it, so that single
photons do not dominate the share of grazing light."""


def grazing_share(photons: PhotonMap, cells: SurfaceCells, where: NDArray[np.bool_]) -> float:
    """Return the share of the flux across the light that lands at a cosine below `GRAZING_COSINE`.

    Args:
        photons: the photons of the pilot pass.
        cells: surface cells.
        where: (cells,) mask of the cells in or near the camera's view; only photons that land in
            these count.
    """
    index = dr.arange(mi.UInt32, photons.count)
    place = dr.gather(mi.Vector4f, photons.place, index)
    cell, found = cell_at(cells, mi.Point3f(place.x, place.y, place.z), mi.Bool(True))
    seen = found & (dr.gather(mi.UInt32, indices(where), cell, found) != 0)
    cosine = dr.gather(mi.Float, photons.travel, index * 4 + 3)
    if photons.coloured:
        colour = dr.gather(mi.Vector4f, photons.power, index)
        power = (colour.x + colour.y + colour.z) / 3
    else:
        power = dr.gather(mi.Float, photons.power, index)
    across = dr.select(seen, power / dr.maximum(cosine, MIN_COSINE), 0)
    dr.eval(across, cosine)
    light = np.asarray(across, dtype=np.float64)
    grazing = np.asarray(cosine) < GRAZING_COSINE
    return float(light[grazing].sum() / max(light.sum(), 1e-30))
