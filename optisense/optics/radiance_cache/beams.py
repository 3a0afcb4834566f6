"""The radiance cache as short lists of beams, for points on the undeformed surface.

A cell of the cache keeps its light in many narrow direction bins. Most of them hold a little
scattered light, and a few hold the lamps. Where the surface is not tilted, four weak neighbouring
bins can be merged into one beam without a visible change (see tests/optics/test_beams.py), so that
a short list remains.
"""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from optisense.optics.backend.arrays import indices
from optisense.optics.radiance_cache._direction_bins import FINE_BINS, Tables
from optisense.optics.radiance_cache.angular_variance import angular_variance, passes_near
from optisense.optics.scene.surface_cells import SurfaceCells, bin_axis

STRONG_SHARE = 0.03
"""Share of a group's light in a cell above which four neighbouring bins stay separate beams.
Merging all weaker ones changes no error, and without it images from a finished cache take a quarter
longer (benchmarks/ablation.md)."""
SPARSE_SHARE = 0.003
"""Share of a group's light in a cell below which a beam may come from a single photon, which gives
no estimate of its variance. Where bins are fine, the peaks of the narrowest lobes
(`TRACED_ROUGHNESS`) see such beams at least as wide as 16 bins; otherwise the noise of quarters of
the skin around a contact of GelSight Mini would be 8.9 instead of 4.5 % with 300,000 photons.
Light at the side of a lobe grows with the variance of a beam. If broader lobes saw these beams
widened, the skin of GelSight Mini of specularity 0.8 would be 0.5 to 1 % brighter; and if the tails
of the narrowest lobes did, the middle of its skin of specularity 1 would be 1.2 % brighter."""
NUMBER_SHIFT = 8
"""Number of low bits of a beam's tag that hold its light group, of which there are at most 256; the
bits above hold the beam's number."""
SPARSE_FLAG = 0x80000000
"""Bit of a beam's tag that is set if it may come from a single photon. Numbers of beams, at most
five for each block of four of 1,024 bins, do not reach it."""
NO_SLOT = 0xFFFFFFFF
"""Marker of a direction bin that the cache does not hold: a number of all one bits, which no index
reaches."""
READ_DISTANCE = 1.5
"""Largest distance, in cell sides, between a cell's centre and a point that reads its beams. A
point reads a cell up to half a side away along each axis from its own, so that the centre is up to
sqrt(3) / 2 + 1 / 2 = 1.4 sides away."""


@dataclass
class Beams:
    """Beams in the order of cells, and of light groups within each cell.

    Attributes:
        starts: index of the first beam of each cell and group, and the total number at the end.
        ways: four floats per beam: the unit direction towards the light, and the mean cosine
            between the light and that direction.
        fluxes: four floats per beam: the flux density (mW/mm^2) across the beam in R, G, B, and a
            tag of bits with the light group, the beam's number (see `NUMBER_SHIFT`) and
            `SPARSE_FLAG`. The number follows from the direction bins of the beam alone, not from
            how many other beams there are.
        heights: mean squared component of the directions of each beam along the bins' axis.
        sparse_cosine: upper bound on the mean cosine of beams that may come from a single photon,
            where they are widened (see `widened`).
    """

    starts: mi.UInt32
    ways: mi.Float
    fluxes: mi.Float
    heights: mi.Float
    sparse_cosine: mi.Float

    def widened(self, cosine: mi.Float, tag: mi.UInt32) -> mi.Float:
        """Return the mean cosines (n,) of beams of mean cosines (n,) and tags (n,), of which those
        that may come from a single photon are widened.

        Besides the peaks of the narrowest lobes, shadow rays and the guide of lobes see them so.
        """
        sparse = (tag & SPARSE_FLAG) != 0
        return dr.select(sparse, dr.minimum(cosine, self.sparse_cosine), cosine)


@dataclass
class BlocksOfBins:
    """The light of a cache in blocks of four neighbouring direction bins.

    Attributes:
        tables, groups, coloured: as in `BinnedLight`.
        four: indices of each block's bins among the bins that hold light; `NO_SLOT` for others.
        numbers: number of each block.
        blocks: number of blocks.
        used: number of bins that hold light.
        total: flux density of each cell and group.
    """

    tables: Tables
    groups: int
    coloured: bool
    four: mi.UInt32
    numbers: mi.UInt32
    blocks: mi.UInt32
    used: mi.UInt32
    total: mi.Float


def collect_beams(
    tables: Tables, coloured: bool, used: NDArray[np.integer], across: int, cells: int, groups: int
) -> Beams:
    """Merge the direction bins of a cache into beams.

    Args:
        tables, coloured: as in `BinnedLight`.
        used: (k,) ascending numbers of the direction bins that the cache holds.
        across: number of bands, and of sectors in each band; even.
        cells: number of cells.
        groups: number of light groups.
    """
    slots = np.full(across**2, NO_SLOT, dtype=np.uint32)
    slots[used] = np.arange(len(used))
    block = np.arange(across**2 // 4)
    corner = (block // (across // 2)) * 2 * across + (block % (across // 2)) * 2
    four = slots[corner[:, None] + np.array([0, 1, across, across + 1])]
    # Blocks without any light are skipped.
    lit = (four != NO_SLOT).any(axis=1)
    four = four[lit]
    entries = cells * groups
    lane = dr.arange(mi.UInt32, entries)
    count_used = dr.opaque(mi.UInt32, len(used))
    light = BlocksOfBins(
        tables=tables,
        groups=groups,
        coloured=coloured,
        four=indices(four),
        numbers=indices(block[lit]),
        blocks=dr.opaque(mi.UInt32, len(four)),
        used=count_used,
        total=_total(tables.moments, count_used, groups, lane),
    )
    # A disc of the solid angle of 16 bins has R^2 = 64 / bins, and a mean cosine of 1 - R^2 / 4.
    widest = 1 - 16 / across**2 if across >= FINE_BINS.across else 1.0
    sparse_cosine = dr.opaque(mi.Float, widest)
    ways, fluxes, heights = (dr.zeros(mi.Float, 4) for _ in range(3))
    nowhere = Beams(dr.zeros(mi.UInt32, entries + 1), ways, fluxes, heights, sparse_cosine)
    count = _collect(light, lane, nowhere, False)
    padded = dr.zeros(mi.UInt32, entries + 1)
    dr.scatter(padded, count, lane)
    starts = dr.prefix_sum(padded)
    dr.eval(starts)
    number = max(int(starts[entries]), 1)
    ways, fluxes, heights = (dr.zeros(mi.Float, count * number) for count in (4, 4, 1))
    found = Beams(starts, ways, fluxes, heights, sparse_cosine)
    _collect(light, lane, found, True)
    dr.eval(found.ways, found.fluxes, found.heights)
    return found


@dr.syntax
def _total(moments: mi.Float, used: mi.UInt32, groups: int, lane: mi.UInt32) -> mi.Float:
    cell, group = lane // groups, lane % groups
    total = mi.Float(0)
    k = mi.UInt32(0)
    while dr.hint(k < used, exclude=[moments, used, groups, cell, group]):
        total += dr.gather(mi.Float, moments, ((cell * used + k) * groups + group) * 4 + 3)
        k += 1
    return total


@dr.syntax
def _collect(light: BlocksOfBins, lane: mi.UInt32, beams: Beams, write: bool) -> mi.UInt32:
    """Count the beams of each lane's cell and group, or write them from its start on."""
    groups, used, total = light.groups, light.used, light.total
    coloured = light.coloured
    cell, group = lane // groups, lane % groups
    first = dr.gather(mi.UInt32, beams.starts, lane)
    slot = mi.UInt32(first)
    k = mi.UInt32(0)
    while dr.hint(k < light.blocks, exclude=[light, beams, groups, used, total, cell, group]):
        values = []
        tall = []
        inks = []
        whole = mi.Vector4f(0)
        ink = mi.Vector4f(0)
        for i in range(4):
            bin_slot = dr.gather(mi.UInt32, light.four, k * 4 + i)
            there = bin_slot != NO_SLOT
            entry = (cell * used + bin_slot) * groups + group
            value = dr.gather(mi.Vector4f, light.tables.moments, entry, there)
            values.append(value)
            whole += value
            if dr.hint(write, mode="scalar"):
                tall.append(dr.gather(mi.Float, light.tables.heights, entry, there))
            if dr.hint(write and coloured, mode="scalar"):
                inks.append(dr.gather(mi.Vector4f, light.tables.colours, entry, there))
                ink += inks[i]
        strong = dr.abs(whole.w) > STRONG_SHARE * total
        if dr.hint(not (write and coloured), mode="scalar"):
            inks = [mi.Vector4f(value.w) for value in values]
            ink = mi.Vector4f(whole.w)
        chosen = [strong & (value.w != 0) for value in values]
        chosen.append(~strong & (whole.w != 0))
        values.append(whole)
        inks.append(ink)
        if dr.hint(write, mode="scalar"):
            tall.append(tall[0] + tall[1] + tall[2] + tall[3])
        for i in range(5):
            if dr.hint(write, mode="scalar"):
                value = values[i]
                length = dr.norm(mi.Vector3f(value.x, value.y, value.z))
                scale = dr.sign(value.w) * dr.rcp(dr.maximum(length, 1e-30))
                cosine = dr.minimum(length / dr.maximum(dr.abs(value.w), 1e-30), 1.0)
                sparse = dr.abs(value.w) < SPARSE_SHARE * total
                way = mi.Vector4f(value.x * scale, value.y * scale, value.z * scale, cosine)
                dr.scatter(beams.ways, way, slot, chosen[i])
                number = dr.gather(mi.UInt32, light.numbers, k) * 5 + i
                tag = group | (number << NUMBER_SHIFT)
                tag |= dr.select(sparse, mi.UInt32(SPARSE_FLAG), 0)
                bits = dr.reinterpret_array(mi.Float, tag)
                flux = mi.Vector4f(inks[i].x, inks[i].y, inks[i].z, bits)
                dr.scatter(beams.fluxes, flux, slot, chosen[i])
                squared = dr.maximum(tall[i] / dr.select(chosen[i], value.w, 1), 0)
                dr.scatter(beams.heights, squared, slot, chosen[i])
            slot += dr.select(chosen[i], mi.UInt32(1), mi.UInt32(0))
        k += 1
    return slot - first


def cull_beams(beams: Beams, cells: SurfaceCells, groups: int, balls: mi.Float) -> Beams:
    """Return the beams that may touch one of the balls before they reach their cell.

    Args:
        cells: the cells that the beams belong to.
        groups: number of light groups.
        balls: (4 k,) centre and radius of each ball, four floats, mm.
    """
    entries = cells.cells * groups
    lane = dr.arange(mi.UInt32, entries)
    near = dr.zeros(mi.UInt32, dr.width(beams.ways) // 4)
    margin = READ_DISTANCE / cells.inverse_size
    place = Neighbourhood(
        cells.middles, balls, dr.opaque(mi.UInt32, dr.width(balls) // 4), margin, bin_axis(cells, 2)
    )
    count = _mark_near(beams, place, dr.opaque(mi.UInt32, groups), lane, near)
    counts = dr.zeros(mi.UInt32, entries + 1)
    dr.scatter(counts, count, lane)
    dr.eval(counts, near)
    chosen = dr.compress(near != 0)
    if dr.width(chosen) == 0:
        chosen = dr.zeros(mi.UInt32, 1)
    ways, fluxes = (
        dr.ravel(dr.gather(mi.Vector4f, values, chosen)) for values in (beams.ways, beams.fluxes)
    )
    heights = dr.gather(mi.Float, beams.heights, chosen)
    return Beams(dr.prefix_sum(counts), ways, fluxes, heights, beams.sparse_cosine)


@dataclass
class Neighbourhood:
    """Cells, and the balls that occlude light from them.

    Attributes:
        middles: centre of each cell, four floats, mm.
        balls: centre and radius of each ball, four floats, mm.
        count: number of balls.
        margin: distance by which the balls are enlarged, mm.
        axis: axis of the direction bins.
    """

    middles: mi.Float
    balls: mi.Float
    count: mi.UInt32
    margin: mi.Float
    axis: mi.Vector3f


@dr.syntax
def _mark_near(
    beams: Beams, place: Neighbourhood, groups: mi.UInt32, lane: mi.UInt32, near: mi.UInt32
) -> mi.UInt32:
    """Set ``near`` to 1 for beams that pass near a ball, and count them per cell and group."""
    middle = dr.gather(mi.Vector4f, place.middles, lane // groups)
    point = mi.Point3f(middle.x, middle.y, middle.z)
    count = mi.UInt32(0)
    j = dr.gather(mi.UInt32, beams.starts, lane)
    end = dr.gather(mi.UInt32, beams.starts, lane + 1)
    while dr.hint(j < end, exclude=[beams, place, point, end]):
        way = dr.gather(mi.Vector4f, beams.ways, j)
        tag = dr.reinterpret_array(mi.UInt32, dr.gather(mi.Float, beams.fluxes, 4 * j + 3))
        height = dr.gather(mi.Float, beams.heights, j)
        cosine = beams.widened(way.w, tag)
        light = angular_variance(place.axis, mi.Vector3f(way.x, way.y, way.z), cosine, height)
        touches = mi.Bool(False)
        n = mi.UInt32(0)
        while dr.hint(n < place.count, exclude=[place, point, light]):
            ball = dr.gather(mi.Vector4f, place.balls, n)
            ball.w += place.margin
            touches |= passes_near(ball, point, light)
            n += 1
        dr.scatter(near, mi.UInt32(1), j, touches)
        count += dr.select(touches, mi.UInt32(1), mi.UInt32(0))
        j += 1
    return count
