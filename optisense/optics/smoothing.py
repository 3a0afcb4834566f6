"""The kernel that a light field is smoothed with, and how wide it is.

Its radius follows the distance of each cell to the nearest lamp, as light near a lamp varies
faster, and shrinks as photons grow, so that what the field blurs goes away with its noise.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix
from scipy.spatial import cKDTree

from optisense.optics.cells import SurfaceCells

FloatArray = NDArray[np.floating]

RADIUS = 1.1
"""mm of the kernel of USUAL_PHOTONS, where lamps are some mm away (see benchmarks)."""
RADIUS_BENT = 0.9
"""The same where the surface is bent more than a little, or a coating is part metal, which shows
from how many directions light comes that a kernel brings together."""
RADIUS_OF_BEND = 0.03
"""Of a surface's radius of curvature, from which on it is bent so much: a kernel there brings
together light that arrives at other slants, and from behind a horizon."""
RADIUS_OF_DISTANCE = 0.2
"""Of the distance to the nearest lamp: nearer lamps make light that varies faster. What is left of
the blur under a point light is then far below 1 % (see `sharpening`)."""
LEAST_RADIUS = 1.5
"""Of the side of a cell, however near a lamp is."""
USUAL_PHOTONS = 5_000_000
SHRINKS_AS = 1 / 6
"""Power of the photons by which the radius falls: noise and bias both go to zero (Knaus and
Zwicker 2011)."""
SHRINKS_TO = 1.0
"""Of the side of a cell, at which the kernel holds the cell and its neighbours."""
WIDEST = 1.5
"""Of that radius: the kernel of the fewest photons."""
WIDEST_OF_METAL = 1.0
"""The same where a coating is part metal."""
WIDER = 2.0
"""How much wider than the kernel that of the sharpening is."""
ALIKE = 0.5
"""Least cosine between the normals of cells that a kernel brings together."""
READ_WIDTH = 1.5
"""Squared radius, of the squared side of a cell, by which a kernel is widened where cells hold
what lands in them and are read from up to half a cell away: three boxes of a cell's side, of
variance 1/12 each, where that of Epanechnikov's kernel is 1/6 of its squared radius."""
MOST_SHARPENED = 0.25
"""Change of a cell's light by the sharpening, at most."""


@dataclass
class Smoothing:
    """Kernel-weighted sums among cells: rows of a sparse matrix, by start, neighbour and weight.

    ``blur`` is the same with what the cells themselves blur (not where a coating is part metal:
    what else they bring together there makes up for it).
    """

    start: mi.UInt32
    cell: mi.UInt32
    weight: mi.Float
    matrix: csr_matrix
    blur: csr_matrix


class Kernels:
    """The kernels of a surface's cells, for any number of photons."""

    def __init__(
        self,
        cells: SurfaceCells,
        lamp_distance: FloatArray,
        near: NDArray[np.bool_] | None = None,
    ) -> None:
        """``lamp_distance`` (cells,) mm: how far the nearest lamp is; ``near`` (cells,) is whether
        the camera sees a cell or one near it: others are hardly smoothed, which saves time."""
        self.cells = cells
        self.near = np.ones(cells.cells, dtype=bool) if near is None else near
        self._size = 1 / float(cells.inverse_size[0])
        by_bend = RADIUS_OF_BEND / np.maximum(bend(cells, RADIUS), 1e-9)
        self._most = np.minimum(
            RADIUS_OF_DISTANCE * np.asarray(lamp_distance), np.clip(by_bend, RADIUS_BENT, RADIUS)
        )
        self._known: dict[tuple[float, bool], Smoothing] = {}

    def _usual(self, metallic: bool) -> FloatArray:
        most = np.minimum(self._most, RADIUS_BENT) if metallic else self._most
        return np.maximum(most, LEAST_RADIUS * self._size)

    def radii(self, photons: int, metallic: bool = False) -> FloatArray:
        """(cells,) mm: the kernel's radius in each cell in a field of so many photons."""
        usual = self._usual(metallic)
        least = np.minimum(SHRINKS_TO * self._size, usual)
        return np.where(self.near, np.maximum(usual * _scale(photons, metallic), least), least)

    def smoothing(self, photons: int, metallic: bool = False) -> Smoothing:
        """The kernel for a field of so many photons."""
        key = _scale(photons, metallic), metallic
        if key not in self._known:
            radii = self.radii(photons, metallic)
            matrix = kernel_matrix(self.cells, radii)
            self._known = {
                key: Smoothing(
                    start=_copied(mi.UInt32, matrix.indptr),
                    cell=_copied(mi.UInt32, matrix.indices),
                    weight=_copied(mi.Float, matrix.data),
                    matrix=matrix,
                    blur=matrix if metallic else self._blur(radii),
                )
            }
        return self._known[key]

    def _blur(self, radii: FloatArray) -> csr_matrix:
        return kernel_matrix(self.cells, np.sqrt(radii**2 + READ_WIDTH * self._size**2))

    @cached_property
    def _wide(self) -> csr_matrix:
        radii = np.where(self.near, WIDER * self._usual(False), SHRINKS_TO * self._size)
        return kernel_matrix(self.cells, radii)

    def sharpening(self, landed: FloatArray, photons: int, metallic: bool = False) -> FloatArray:
        """Factors (cells, groups) that undo most of what the kernel and the cells blur.

        They take from peaks and give to hollows, by what they make of a smooth estimate of the
        light, too: multiplicative bias correction (Jones, Linton and Nielsen 1995). The
        estimate is smoothed more widely, so that it brings little noise.

        Args:
            landed: (cells, groups) mW on each cell.
            photons: of the field.
        """
        smooth = self._wide @ landed
        again = self.smoothing(photons, metallic).blur @ (smooth * self.cells.areas[:, None])
        sharpened = (again > 0) & self.near[:, None]
        factor = np.divide(smooth, again, out=np.ones_like(smooth), where=sharpened)
        return np.clip(factor, 1 - MOST_SHARPENED, 1 + MOST_SHARPENED)


def _scale(photons: int, metallic: bool) -> float:
    widest = WIDEST_OF_METAL if metallic else WIDEST
    return float(min(widest, (USUAL_PHOTONS / max(photons, 1)) ** SHRINKS_AS))


def bend(cells: SurfaceCells, distance: float) -> FloatArray:
    """(cells,) 1/mm: the curvature along which normals turn most, towards cells within
    ``distance`` mm; edges, across which a kernel does not reach, do not count."""
    pairs = cKDTree(cells.centres).query_pairs(distance, output_type="ndarray")
    one, other = pairs.T
    cosine = np.einsum("ij,ij->i", cells.normals[one], cells.normals[other])
    turn = np.where(cosine > ALIKE, np.arccos(np.clip(cosine, -1.0, 1.0)), 0.0)
    turn /= np.maximum(np.linalg.norm(cells.centres[one] - cells.centres[other], axis=1), 1e-9)
    most = np.zeros(cells.cells)
    np.maximum.at(most, one, turn)
    np.maximum.at(most, other, turn)
    return most


def kernel_matrix(cells: SurfaceCells, radii: FloatArray) -> csr_matrix:
    """Epanechnikov's kernel around each cell, (cells, cells): sums of mW on cells to mW/mm^2.

    It is normalised by the surface's area under it, so edges and oblique cells lose nothing;
    surfaces that look elsewhere do not count.
    """
    tree = cKDTree(cells.centres)
    near = tree.sparse_distance_matrix(tree, float(radii.max()), output_type="coo_matrix").tocsr()
    near.setdiag(1e-9)
    near.sort_indices()
    rows = np.repeat(np.arange(cells.cells), np.diff(near.indptr))
    columns = near.indices
    normals = cells.normals
    alike = np.einsum("ij,ij->i", normals[rows], normals[columns]) > ALIKE
    weight = np.maximum(1 - (near.data / radii[rows]) ** 2, 0.0) * alike
    kept = weight > 0
    rows, columns, weight = rows[kept], columns[kept], weight[kept]
    weight /= np.bincount(rows, weight * cells.areas[columns], cells.cells)[rows]
    return csr_matrix((weight, (rows, columns)), shape=(cells.cells, cells.cells))


def _copied(kind: Any, values: FloatArray | NDArray[np.integer]) -> Any:
    """Values on the device: arrays handed over from numpy differ in alignment, and so would
    kernels."""
    return kind(values.astype(np.float32 if kind is mi.Float else np.uint32)) + dr.opaque(kind, 0)


@dr.syntax
def smooth(
    kernel: Smoothing,
    cells: int,
    tables: list[mi.Float],
    kinds: list[Any],
    bins: mi.UInt32,
    stride: mi.UInt32,
    groups: int,
    factors: mi.Float,
) -> list[Any]:
    """Kernel-weighted sums over neighbouring cells of the chosen bins, for tables whose entries are
    of these kinds (`mi.Float` or a vector): first the moments of a light field.

    ``factors`` (cells times groups) multiply the sums.
    """
    lane = dr.arange(mi.UInt32, cells * dr.width(bins) * groups)
    used = dr.opaque(mi.UInt32, dr.width(bins))  # not part of the kernel, which then is kept
    group = lane % groups
    rest = lane // groups
    slot = dr.gather(mi.UInt32, bins, rest % used) * groups + group
    cell = rest // used
    j = dr.gather(mi.UInt32, kernel.start, cell)
    end = dr.gather(mi.UInt32, kernel.start, cell + 1)
    totals = [kind(0) for kind in kinds]
    while j < end:
        other = dr.gather(mi.UInt32, kernel.cell, j) * (stride * groups) + slot
        # Most bins hold nothing: one look at the fourth float of the first table tells.
        if dr.gather(mi.Float, tables[0], other * 4 + 3) > 0:
            weight = dr.gather(mi.Float, kernel.weight, j)
            for i in range(len(kinds)):
                totals[i] += weight * dr.gather(kinds[i], tables[i], other)
        j += 1
    factor = dr.gather(mi.Float, factors, cell * groups + group)
    return [total * factor for total in totals]
