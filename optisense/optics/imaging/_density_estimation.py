"""Density estimation at visible points from photons in a uniform grid (pairwise SPPM).

A photon's power is divided by the cosine at the place where *it* landed. The quotient is the flux
through a plane across its path, which hardly changes in the neighbourhood, while the density of
landings follows the local tilt. Reflection is then evaluated with the visible point's own normal.
The kernel is Epanechnikov's, over a disc of radius r.
"""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from optisense.optics.scene.coating_bsdf import coating_of, evaluate_coating
from optisense.optics.transport.camera_paths import VisiblePoints
from optisense.optics.transport.photon_map import GROUP_MASK, PhotonMap

MIN_COSINE = 0.03
"""Lower bound on the cosine of incidence (88 degrees) that a photon's power is divided by, so that
an isolated grazing photon does not become a bright spot. It darkens light below 2 degrees, which is
a small part of all light."""


@dataclass
class PhotonGrid:
    """Photons in the order of the cells of a uniform grid.

    Attributes:
        lower: lower corner of the grid, mm.
        inverse_size: inverse of the side of a cell, 1/mm.
        counts: numbers of cells along x, y and z.
        starts: (cells + 1,) index of the first photon of each cell, and the number of photons.
        place, travel, power, coloured: as in `PhotonMap`.
    """

    lower: mi.Point3f
    inverse_size: mi.Float
    counts: mi.Vector3u
    starts: mi.UInt32
    place: mi.Float
    travel: mi.Float
    power: mi.Float
    coloured: bool


def _cell(
    point: mi.Point3f, lower: mi.Point3f, inverse: mi.Float, counts: mi.Vector3u
) -> mi.Vector3u:
    relative = (point - lower) * inverse
    return mi.Vector3u(
        *(mi.UInt32(dr.clip(relative[i], 0.0, mi.Float(counts[i] - 1))) for i in range(3))
    )


def build_grid(
    photons: PhotonMap, lower: NDArray[np.floating], upper: NDArray[np.floating], radius: float
) -> PhotonGrid:
    """Sort photons into the cells of a grid by counting sort.

    Args:
        lower, upper: corners (3,) of the box that the grid fills, mm.
        radius: side (mm) of the cells; larger where there would be more than 30 million cells.
    """
    size = [max(float(upper[i] - lower[i]), radius) for i in range(3)]
    cell_size = max(radius, max(size) / 1000)
    while True:
        counts = [int(s / cell_size) + 1 for s in size]
        if counts[0] * counts[1] * counts[2] < 30_000_000:
            break
        cell_size *= 1.3
    lower3 = mi.Point3f(*map(float, lower))
    inverse = dr.opaque(mi.Float, 1 / cell_size)
    counts3 = mi.Vector3u(*counts)
    dr.make_opaque(lower3, counts3)
    cells = counts[0] * counts[1] * counts[2]
    index = dr.arange(mi.UInt32, photons.count)
    place = dr.gather(mi.Vector4f, photons.place, index)
    cell = _cell(mi.Point3f(place.x, place.y, place.z), lower3, inverse, counts3)
    flat = cell.x + counts3.x * (cell.y + counts3.y * cell.z)
    tally = dr.zeros(mi.UInt32, cells + 1)
    rank = dr.scatter_inc(tally, flat)
    dr.eval(rank, tally)
    starts = dr.prefix_sum(tally)
    target = dr.gather(mi.UInt32, starts, flat) + rank
    out_place = dr.zeros(mi.Float, photons.count * 4)
    out_travel = dr.zeros(mi.Float, photons.count * 4)
    out_power = dr.zeros(mi.Float, photons.count * (4 if photons.coloured else 1))
    dr.scatter(out_place, place, target)
    dr.scatter(out_travel, dr.gather(mi.Vector4f, photons.travel, index), target)
    if photons.coloured:
        dr.scatter(out_power, dr.gather(mi.Vector4f, photons.power, index), target)
    else:
        dr.scatter(out_power, dr.gather(mi.Float, photons.power, index), target)
    dr.eval(out_place, out_travel, out_power, starts)
    return PhotonGrid(
        lower3, inverse, counts3, starts, out_place, out_travel, out_power, photons.coloured
    )


@dr.syntax
def estimate_radiance(
    grid: PhotonGrid,
    surfaces: mi.Float,
    points: VisiblePoints,
    radius: mi.Float,
    groups: int,
) -> list[mi.Color3f]:
    """Return the radiance (3, n) of visible points towards the camera for each light group, with
    lights of 1 mW.

    Args:
        surfaces: the table of surfaces (`surface_table`).
        radius: radius (mm) of the disc over which photons are counted.
        groups: number of light groups.
    """
    coating = coating_of(surfaces, points.surface, points.valid)
    centre = _cell(points.point, grid.lower, grid.inverse_size, grid.counts)
    r2 = radius * radius
    totals = [mi.Color3f(0) for _ in range(groups)]
    step = mi.UInt32(0)
    reach = mi.UInt32(dr.ceil(radius * grid.inverse_size))
    low = mi.Vector3u(centre - dr.minimum(reach, centre))
    high = mi.Vector3u(dr.minimum(centre + reach, grid.counts - 1))
    span = high - low + 1
    # Cells along x are neighbours in memory, so that each (y, z) has one contiguous range of
    # photons.
    rows = dr.select(points.valid, span.y * span.z, 0)
    while step < rows:
        y = low.y + step % span.y
        z = low.z + step // span.y
        base = grid.counts.x * (y + grid.counts.y * z)
        j = dr.gather(mi.UInt32, grid.starts, base + low.x)
        end = dr.gather(mi.UInt32, grid.starts, base + high.x + 1)
        while j < end:
            place = dr.gather(mi.Vector4f, grid.place, j)
            offset = mi.Point3f(place.x, place.y, place.z) - points.point
            distance2 = dr.squared_norm(offset)
            if distance2 < r2:
                travel = dr.gather(mi.Vector4f, grid.travel, j)
                direction = mi.Vector3f(travel.x, travel.y, travel.z)
                kernel = 2 * (1 - distance2 / r2) / dr.maximum(travel.w, MIN_COSINE)
                value = (
                    evaluate_coating(coating, points.normal, -direction, points.towards_eye)
                    * kernel
                )
                value = dr.select(dr.dot(points.face_normal, direction) < 0, value, 0)
                if dr.hint(grid.coloured, mode="scalar"):
                    power = dr.gather(mi.Vector4f, grid.power, j)
                    value *= mi.Color3f(power.x, power.y, power.z)
                else:
                    value *= dr.gather(mi.Float, grid.power, j)
                group = dr.reinterpret_array(mi.UInt32, place.w) & GROUP_MASK
                for g in range(groups):
                    totals[g] += dr.select(group == g, value, 0)
            j += 1
        step += 1
    return [total / (dr.pi * r2) for total in totals]
