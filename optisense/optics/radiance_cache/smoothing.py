"""The kernel that a light field is smoothed with, and how wide it is.

Light varies over a length that follows the distance of each cell to the nearest lamp, and the
surface's bend. Blur grows as the square of the kernel's radius over that length, noise falls as the
radius grows and as photons do; the radius is the one that makes least of both, so both go to zero.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix
from scipy.spatial import cKDTree

from optisense.optics.backend.arrays import floats, indices
from optisense.optics.scene.surface_cells import SurfaceCells

FloatArray = NDArray[np.floating]

RADIUS = 1.6
"""mm of the kernel where `USUAL_DENSITY` photons land on a mm^2 and light varies over `LENGTH`."""
USUAL_DENSITY = 1000.0
"""Photons on a mm^2."""
LENGTH = 10.0
"""mm over which light varies under a lamp as far away."""
SHRINKS_AS = 1 / 6
"""Power of the density of photons by which the radius falls: a blur that goes as the square of
the radius, and noise as its inverse, are then least together; both go to zero (Silverman 1986,
chapter 4; Knaus and Zwicker 2011)."""
GROWS_AS = 2 / 3
"""Power of the length over which light varies by which the radius grows, for the same reason."""
WIDEST = 0.3
"""Of that length: the kernel of the fewest photons. What is left of its blur is below 1 % (see
`sharpening`)."""
LEAST = 1.5
"""Of the side of a cell, however near a lamp is; with many photons this shrinks, too."""
SHRINKS_TO = 1.25
"""Of the side of a cell, at which the kernel holds the cell and its neighbours."""
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
        density: float,
        near: NDArray[np.bool_] | None = None,
        scouted: FloatArray | None = None,
        scouts: float = 0.0,
    ) -> None:
        """
        Args:
            cells: of the surface.
            lamp_distance: (cells,) mm, how far the nearest lamp is.
            density: 1/mm^2, how many photons land on a mm^2, for each that is sent out.
            near: (cells,) whether the camera sees a cell or one near it: others are hardly
                smoothed, which saves time.
            scouted: (2, cells, groups) mW on each cell by two halves of some photons, which tell
                where light varies faster than its lamps' distance makes it.
            scouts: 1/mm^2, how many of these photons there are.
        """
        self.cells = cells
        self.near = np.ones(cells.cells, dtype=bool) if near is None else near
        self.density = density
        self._size = 1 / float(cells.inverse_size[0])
        self._length = np.maximum(np.asarray(lamp_distance), 1e-3)
        if scouted is not None:
            found = varies_over(cells, scouted, self._radii(scouts))
            self._length = np.minimum(self._length, found)
        self._known: dict[tuple[int, bool], Smoothing] = {}

    def radii(self, photons: int) -> FloatArray:
        """(cells,) mm: the kernel's radius in each cell in a field of so many photons."""
        return self._radii(self.density * photons)

    def _radii(self, density: float) -> FloatArray:
        wider = (USUAL_DENSITY / max(density, 1e-9)) ** SHRINKS_AS
        best = RADIUS * (self._length / LENGTH) ** GROWS_AS * wider
        least = float(np.clip(LEAST * wider, SHRINKS_TO, LEAST)) * self._size
        most = np.maximum(WIDEST * self._length, least)
        return np.where(self.near, np.clip(best, least, most), SHRINKS_TO * self._size)

    def smoothing(self, photons: int, metallic: bool = False) -> Smoothing:
        """The kernel for a field of so many photons."""
        key = photons, metallic
        if key not in self._known:
            radii = self.radii(photons)
            matrix = kernel_matrix(self.cells, radii)
            self._known = {
                key: Smoothing(
                    start=indices(matrix.indptr),
                    cell=indices(matrix.indices),
                    weight=floats(matrix.data),
                    matrix=matrix,
                    blur=matrix if metallic else self._blur(radii),
                )
            }
        return self._known[key]

    def _blur(self, radii: FloatArray) -> csr_matrix:
        return kernel_matrix(self.cells, np.sqrt(radii**2 + READ_WIDTH * self._size**2))

    def sharpening(self, landed: FloatArray, photons: int, metallic: bool = False) -> FloatArray:
        """Factors (cells, groups) that undo most of what the kernel and the cells blur.

        They take from peaks and give to hollows, by what they make of their own result:
        multiplicative bias correction (Jones, Linton and Nielsen 1995).

        Args:
            landed: (cells, groups) mW on each cell.
            photons: of the field.
        """
        kernel = self.smoothing(photons, metallic)
        smooth = kernel.matrix @ landed
        again = kernel.blur @ (smooth * self.cells.areas[:, None])
        sharpened = (again > 0) & self.near[:, None]
        factor = np.divide(smooth, again, out=np.ones_like(smooth), where=sharpened)
        return np.clip(factor, 1 - MOST_SHARPENED, 1 + MOST_SHARPENED)


def varies_over(cells: SurfaceCells, halves: FloatArray, radii: FloatArray) -> FloatArray:
    """(cells,) mm: the distance of a lamp whose light a kernel would blur as much as this light.

    Under a lamp at a distance h a kernel of radius r takes r^2 / (2 h^2) of the light. How much it
    takes of this light is told by what it takes of its own result: by the product of what two
    halves of the photons tell, which is free of their noise, where it is larger than that. Groups
    count alike, by their light where it is.

    Args:
        halves: (2, cells, groups) mW on each cell.
        radii: (cells,) mm of the kernels.
    """
    kernel = kernel_matrix(cells, radii)
    areas = cells.areas[:, None]
    once = [kernel @ half for half in halves]
    one, other = (kernel @ (light * areas) - light for light in once)
    scale = np.maximum(np.prod([(light * areas).mean(axis=0) for light in once], axis=0), 1e-30)
    changes, squares = (
        np.maximum(kernel @ (each / scale * areas), 0.0).sum(axis=1)
        for each in (one * other - (one - other) ** 2, once[0] * once[1])
    )
    relative = np.sqrt(changes / np.maximum(squares, 1e-30))
    return np.asarray(radii / np.sqrt(2 * np.maximum(relative, 1e-9)))


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
