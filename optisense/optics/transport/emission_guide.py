"""Where to send photons: for each light, a table over the unit square of its emission angles.

Light that never reaches the sensing surface (it leaves through a side, or circles in the light
guide) tells nothing. A pilot pass finds out from which emission angles photons arrive; later
passes send more photons there and weight them down in exchange, so the estimate stays unbiased:
no cell gets less than ``FLOOR`` of the even density.
"""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

CELLS = 16
FLOOR = 0.15


@dataclass
class Guide:
    """Cumulative tables: rows (lights, CELLS+1), columns (lights, CELLS, CELLS+1); ``arriving`` is
    the part of the photons sent so that arrive, 1 where nobody knows."""

    rows: mi.Float
    columns: mi.Float
    arriving: float = 1.0


def guide_from_density(density: NDArray[np.floating]) -> Guide:
    """A guide that follows ``density`` (lights, CELLS, CELLS), any scale, floored at FLOOR of
    its mean.
    """
    even = _floored(np.asarray(density, dtype=np.float64))
    by_row = even.sum(axis=2)
    rows = np.zeros((len(density), CELLS + 1))
    rows[:, 1:] = np.cumsum(by_row, axis=1) / by_row.sum(axis=1, keepdims=True)
    columns = np.zeros((len(density), CELLS, CELLS + 1))
    columns[:, :, 1:] = np.cumsum(even, axis=2) / by_row[:, :, None]
    return Guide(
        mi.Float(rows.ravel().astype(np.float32)), mi.Float(columns.ravel().astype(np.float32))
    )


def _floored(density: NDArray[np.float64]) -> NDArray[np.float64]:
    """Densities in relation to the mean of each light, with the floor in."""
    mean = density.mean(axis=(1, 2), keepdims=True)
    even = np.where(mean > 0, density / np.where(mean > 0, mean, 1), 1.0)
    return (1 - FLOOR) * even + FLOOR


def even_guide(lights: int) -> Guide:
    """A guide that changes nothing."""
    return guide_from_density(np.ones((lights, CELLS, CELLS)))


def _invert(
    table: mi.Float, start: mi.UInt32, value: mi.Float
) -> tuple[mi.UInt32, mi.Float, mi.Float]:
    cell = mi.UInt32(0)
    step = CELLS // 2
    while step:
        middle = dr.gather(mi.Float, table, start + cell + step)
        cell = dr.select(value >= middle, cell + step, cell)
        step //= 2
    low = dr.gather(mi.Float, table, start + cell)
    high = dr.gather(mi.Float, table, start + cell + 1)
    width = dr.maximum(high - low, 1e-9)
    return cell, dr.clip((value - low) / width, 0, 0.999999), width


def warp(
    guide: Guide, light: mi.UInt32, sample: mi.Point2f
) -> tuple[mi.Point2f, mi.Float, mi.UInt32]:
    """Moved sample, its weight (1 / density), and the number of its cell."""
    row, y, dy = _invert(guide.rows, light * (CELLS + 1), sample.x)
    column, x, dx = _invert(guide.columns, (light * CELLS + row) * (CELLS + 1), sample.y)
    moved = mi.Point2f((mi.Float(row) + y) / CELLS, (mi.Float(column) + x) / CELLS)
    weight = dr.rcp(dy * dx * (CELLS * CELLS))
    return moved, weight, row * CELLS + column


def learn_guide(cells: mi.UInt32, lights: int, per_light: int) -> Guide:
    """A guide from a pilot pass of so many photons a light, sent evenly: ``cells`` holds the cell
    (over all lights) of every photon that arrived.
    """
    arrived = np.asarray(cells)
    arrived = arrived[arrived < lights * CELLS * CELLS]
    counts = np.bincount(arrived, minlength=lights * CELLS * CELLS).reshape(-1, CELLS, CELLS)
    wanted = np.sqrt(counts)
    guide = guide_from_density(wanted)
    guide.arriving = float((_floored(wanted) * counts).sum() / (per_light * lights))
    return guide
