"""Emission guiding: for each light, a sampling density over the unit square of its emission angles.

Light that never reaches the sensing surface (it leaves through a side, or is trapped in the light
guide) does not contribute. A pilot pass records the emission angles of the photons that arrive.
Later passes sample these more densely and weight each photon with the inverse of the density, so
the estimate stays unbiased: no cell gets less than `MIN_DENSITY` of the uniform density.
"""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from optisense.optics.backend.arrays import floats

GUIDE_CELLS = 16
"""Number of cells along each side of a light's table over the unit square of its emission angles.
With 16, the 300,000 photons of a pilot pass put some 25 (GelSight360) to 400 (DIGIT) into each
cell, whose counts are then known to 20 % or better."""
MIN_DENSITY = 0.15
"""Lower bound on the sampling density, relative to the uniform one. No angle is left out, so the
estimate stays unbiased, and no photon weighs more than 1 / 0.15 = 6.7."""


@dataclass
class EmissionGuide:
    """Cumulative tables over the unit square of each light's emission angles.

    Attributes:
        rows: (lights, GUIDE_CELLS + 1), cumulative over the rows of a light's table.
        columns: (lights, GUIDE_CELLS, GUIDE_CELLS + 1), cumulative along each row.
        arriving: the share of the emitted photons that land in the target cells; 1 if unknown.
    """

    rows: mi.Float
    columns: mi.Float
    arriving: float = 1.0


def guide_from_density(density: NDArray[np.floating]) -> EmissionGuide:
    """Return a guide whose sampling density is proportional to ``density``.

    ``density`` is (lights, GUIDE_CELLS, GUIDE_CELLS), of any scale; it is raised to at least
    `MIN_DENSITY` times the mean of each light.
    """
    even = _floored(np.asarray(density, dtype=np.float64))
    by_row = even.sum(axis=2)
    rows = np.zeros((len(density), GUIDE_CELLS + 1))
    rows[:, 1:] = np.cumsum(by_row, axis=1) / by_row.sum(axis=1, keepdims=True)
    columns = np.zeros((len(density), GUIDE_CELLS, GUIDE_CELLS + 1))
    columns[:, :, 1:] = np.cumsum(even, axis=2) / by_row[:, :, None]
    return EmissionGuide(floats(rows), floats(columns))


def _floored(density: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return densities relative to the mean of each light, raised to at least `MIN_DENSITY`."""
    mean = density.mean(axis=(1, 2), keepdims=True)
    even = np.where(mean > 0, density / np.where(mean > 0, mean, 1), 1.0)
    return (1 - MIN_DENSITY) * even + MIN_DENSITY


def uniform_guide(lights: int) -> EmissionGuide:
    """Return a guide of uniform density."""
    return guide_from_density(np.ones((lights, GUIDE_CELLS, GUIDE_CELLS)))


def _invert(
    table: mi.Float, start: mi.UInt32, value: mi.Float
) -> tuple[mi.UInt32, mi.Float, mi.Float]:
    cell = mi.UInt32(0)
    step = GUIDE_CELLS // 2
    while step:
        middle = dr.gather(mi.Float, table, start + cell + step)
        cell = dr.select(value >= middle, cell + step, cell)
        step //= 2
    low = dr.gather(mi.Float, table, start + cell)
    high = dr.gather(mi.Float, table, start + cell + 1)
    width = dr.maximum(high - low, 1e-9)
    return cell, dr.clip((value - low) / width, 0, 0.999999), width


def warp(
    guide: EmissionGuide, light: mi.UInt32, sample: mi.Point2f
) -> tuple[mi.Point2f, mi.Float, mi.UInt32]:
    """Warp samples so that they have the density of a guide.

    Args:
        light: number (n,) of the light.
        sample: points of the unit square.

    Returns:
        The warped points (2, n); their weight (n,), 1 over the density; and the number (n,) of
        their cell in the light's table.
    """
    row, y, dy = _invert(guide.rows, light * (GUIDE_CELLS + 1), sample.x)
    column, x, dx = _invert(
        guide.columns, (light * GUIDE_CELLS + row) * (GUIDE_CELLS + 1), sample.y
    )
    moved = mi.Point2f((mi.Float(row) + y) / GUIDE_CELLS, (mi.Float(column) + x) / GUIDE_CELLS)
    weight = dr.rcp(dy * dx * (GUIDE_CELLS * GUIDE_CELLS))
    return moved, weight, row * GUIDE_CELLS + column


def learn_guide(cells: mi.UInt32, lights: int, per_light: int) -> EmissionGuide:
    """Learn a guide from a pilot pass of uniform density.

    Args:
        cells: number of the guide's cell (over all lights) of every photon that arrived.
        per_light: number of photons of each light in the pass.
    """
    arrived = np.asarray(cells)
    arrived = arrived[arrived < lights * GUIDE_CELLS * GUIDE_CELLS]
    counts = np.bincount(arrived, minlength=lights * GUIDE_CELLS * GUIDE_CELLS).reshape(
        -1, GUIDE_CELLS, GUIDE_CELLS
    )
    wanted = np.sqrt(counts)
    guide = guide_from_density(wanted)
    guide.arriving = float((_floored(wanted) * counts).sum() / (per_light * lights))
    return guide
