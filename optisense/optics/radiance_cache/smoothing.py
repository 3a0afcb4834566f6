"""The kernels that smooth a radiance cache, and their radii.

Light varies over a length: the distance of the nearest lamp, or less where the pilot photons show
that it varies faster. Blur grows as the square of the kernel's radius over that length; noise falls
as the radius and the number of photons grow. The radius minimises the sum of their squares, so both
go to zero as photons are added.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import drjit as dr
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix, diags, identity
from scipy.spatial import cKDTree

from optisense.array_types import FloatingArray
from optisense.optics.scene.surface_cells import SurfaceCells

REFERENCE_RADIUS = 1.6
"""Kernel radius (mm) at `REFERENCE_DENSITY` and `REFERENCE_LENGTH`: the one that minimises the sum
of squared blur and squared noise."""
REFERENCE_DENSITY = 1000.0
"""Density of landed photons (1/mm^2) that `REFERENCE_RADIUS` refers to; a million photons give
GelSight Mini's 524 mm^2 about as much."""
REFERENCE_LENGTH = 10.0
"""Length (mm) over which light varies that `REFERENCE_RADIUS` refers to: that under a lamp at this
distance."""
DENSITY_EXPONENT = 1 / 6
"""Exponent of the photon density by which the radius falls. Blur grows as the square of the radius
and noise as its inverse; this exponent minimises their sum of squares, and both go to zero
(Silverman 1986, chapter 4; Knaus and Zwicker 2011)."""
LENGTH_EXPONENT = 2 / 3
"""Exponent with which the radius grows with the length over which light varies; it also minimises
the sum of squared blur and squared noise."""
MAX_RADIUS_RATIO = 0.3
"""Largest radius as a fraction of the length over which light varies. The blur that remains after
sharpening is below 1 % (see `Kernels.sharpening`)."""
MIN_RADIUS_CELLS = 1.5
"""Smallest radius, in cell sides, for few photons: the kernel then holds the cell, its neighbours
and the diagonal ones."""
MIN_RADIUS_CELLS_LIMIT = 1.25
"""Smallest radius, in cell sides, for any number of photons: the kernel then holds the cell and its
direct neighbours."""
MIN_NORMAL_COSINE = 0.5
"""Smallest cosine between the normals of two cells that a kernel averages: cells that face
directions more than 60 degrees apart, as on both sides of an edge, get different light."""
CELL_BLUR = 1.5
"""Squared radius, in squared cell sides, by which the blur of the cells widens a kernel. Landing in
a cell and reading from up to half a cell away is three box filters of a cell's side, each of
variance 1/12; the variance of Epanechnikov's kernel is 1/6 of its squared radius."""
CACHED_BYTES = 6e5
"""Size (bytes) of the rows of a table that make one row of a product above which blocks of columns
are multiplied: a third of a processor core's cache of 2 MB. These rows have 1.0 to 1.5 MB on
GelSight360, and at most 0.4 MB on the other built-in sensors with a diffuse coating."""
BLOCK_COLUMNS = 256
"""Number of columns in a block: 1 kB of a row. A product of GelSight360 (3,704 rows with 32 weights
and 11,664 columns) takes 0.33 s of a processor in blocks and 0.86 s with whole rows, and a third
longer with 64 or 1,024 columns in a block."""
LEAST_SHARED_PRODUCT = 1e8
"""Number of multiplications of a matrix product from which on threads share it: about 30 ms of one
processor, several times what it takes to start threads. A draft of GelSight Mini needs 8 million,
which take 1 ms, or 5 ms with threads."""


@dataclass
class Smoothing:
    """The smoothing that is applied to tallied light.

    Attributes:
        kernel: matrix (cells, cells) that smooths, from mW on cells to mW/mm^2.
        blur: the kernel with the blur of the cells themselves added.
        strength: factor (cells,) on the difference that ``blur`` makes, which gives the difference
            that kernel and cells make.
        correction: matrix (cells, cells) that undoes the blur of kernel and cells in smoothed
            light, in cells in or near the camera's view; None without this correction.
    """

    kernel: csr_matrix
    blur: csr_matrix
    strength: FloatingArray
    correction: csr_matrix | None


class Kernels:
    """The kernels of a surface's cells, for any number of photons."""

    def __init__(
        self,
        cells: SurfaceCells,
        lamp_distance: FloatingArray,
        density: float,
        near: NDArray[np.bool_] | None = None,
        pilot_power: FloatingArray | None = None,
        pilot_density: float = 0.0,
    ) -> None:
        """Find the length over which light varies in each cell.

        Args:
            lamp_distance: (cells,) distance (mm) to the nearest lamp.
            density: landings per mm^2 for each emitted photon (1/mm^2).
            near: (cells,) whether a cell is in or near the camera's view. Other cells are smoothed
                with the narrowest kernel, which saves time.
            pilot_power: (2, cells, groups) power (mW) of the two halves of the pilot photons on
                each cell, which shows where light varies over less than the distance of the lamps.
            pilot_density: density of the pilot photons (1/mm^2).
        """
        self.cells = cells
        self.near = np.ones(cells.cells, dtype=bool) if near is None else near
        self.density = density
        self._size = 1 / float(cells.inverse_size[0])
        self._length = np.maximum(np.asarray(lamp_distance), 1e-3)
        if pilot_power is not None:
            found = varies_over(cells, pilot_power, self._radii(pilot_density))
            self._length = np.minimum(self._length, found)
        self._known: dict[tuple[int, bool], Smoothing] = {}

    def radii(self, photons: int) -> FloatingArray:
        """Return the kernel radius (cells,), mm, for this number of emitted photons."""
        return self._radii(self.density * photons)

    def _radii(self, density: float) -> FloatingArray:
        wider = (REFERENCE_DENSITY / max(density, 1e-9)) ** DENSITY_EXPONENT
        best = REFERENCE_RADIUS * (self._length / REFERENCE_LENGTH) ** LENGTH_EXPONENT * wider
        least = (
            float(np.clip(MIN_RADIUS_CELLS * wider, MIN_RADIUS_CELLS_LIMIT, MIN_RADIUS_CELLS))
            * self._size
        )
        most = np.maximum(MAX_RADIUS_RATIO * self._length, least)
        return np.where(self.near, np.clip(best, least, most), MIN_RADIUS_CELLS_LIMIT * self._size)

    def smoothing(self, photons: int, corrected: bool = False) -> Smoothing:
        """Return the kernels for this number of emitted photons.

        Args:
            photons: number of emitted photons.
            corrected: whether the blur is undone in each direction bin by itself. With K the kernel
                and B the blur, light L becomes 2 K L - B K L ("twicing", Stuetzle and Mittal 1979):
                the remaining blur grows with the fourth power of the radius, and the noise is 1.34
                times that of K if both hold many cells. (Where the second moment of B is not that
                of kernel and cells, as both hold few cells, the difference K L - B K L is scaled by
                their ratio.)
        """
        key = photons, corrected
        if key not in self._known:
            radii = self.radii(photons)
            wider = np.sqrt(radii**2 + CELL_BLUR * self._size**2)
            distances = distances_within(self.cells, wider)
            matrix = kernel_matrix(self.cells, radii, distances)
            blur = kernel_matrix(self.cells, wider, distances)
            wanted = self._second_moment(matrix) + CELL_BLUR * self._size**2 / 3
            strength = wanted / np.maximum(self._second_moment(blur), 1e-30)
            twice = self._twice(blur, strength) if corrected else None
            self._known = {key: Smoothing(matrix, blur, strength, twice)}
        return self._known[key]

    def _twice(self, blur: csr_matrix, strength: FloatingArray) -> csr_matrix:
        scale = diags(np.where(self.near, strength, 0.0))
        return (identity(self.cells.cells) + scale - scale @ blur @ diags(self.cells.areas)).tocsr()

    def _second_moment(self, kernel: csr_matrix) -> FloatingArray:
        """Return the mean squared distance (cells,), mm^2, over which a kernel spreads light."""
        centres, areas = self.cells.centres - self.cells.centres.mean(axis=0), self.cells.areas
        means = kernel @ (centres * areas[:, None])
        squares = kernel @ ((centres**2).sum(axis=1) * areas)
        cross = 2 * np.einsum("ij,ij->i", means, centres)
        return np.asarray(squares - cross + (centres**2).sum(axis=1))

    def sharpening(self, landed: FloatingArray, photons: int) -> FloatingArray:
        """Return factors (cells, groups) that undo most of the blur of the kernel and the cells.

        The kernel lowers peaks and fills hollows. Smoothing the smoothed light once more shows by
        how much, and the difference is added ("twicing", see `smoothing`). Light cannot become
        negative: what a cell lacks to zero is taken from the light that the blur brought there. The
        power is conserved. With the ratio in place of the difference (Jones, Linton and Nielsen
        1995), each peak and each edge would add power: 7.6 % of that of a spot of 15 degrees.

        Args:
            landed: (cells, groups) power (mW) on each cell.
            photons: number of emitted photons.
        """
        kernel = self.smoothing(photons)
        areas, near = self.cells.areas[:, None], self.near[:, None]
        smooth = kernel.kernel @ landed
        again = kernel.blur @ (smooth * areas)
        sharp = smooth + np.where(near, kernel.strength[:, None] * (smooth - again), 0.0)
        lacks = np.maximum(-sharp, 0.0)
        share = np.divide(lacks * areas, again, out=np.zeros_like(again), where=lacks > 0)
        sharp = np.maximum(sharp + lacks - smooth * (kernel.blur.T @ share), 0.0)
        return np.divide(sharp, smooth, out=np.ones_like(smooth), where=near & (smooth > 0))


def varies_over(cells: SurfaceCells, halves: FloatingArray, radii: FloatingArray) -> FloatingArray:
    """Return the length (cells,), mm, over which light varies.

    It is the distance of a lamp whose light the kernel would blur as much: under a lamp at distance
    h, a kernel of radius r lowers the peak by r^2 / (2 h^2). The blur is measured by smoothing the
    smoothed light once more. The product of the results of two halves of the photons is free of
    their noise, and it counts where it is larger than the noise. Light groups have equal weights,
    each relative to its own light.

    Args:
        halves: (2, cells, groups) power (mW) of each half of the photons on each cell.
        radii: (cells,) kernel radii (mm).
    """
    kernel = kernel_matrix(cells, radii, distances_within(cells, radii))
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


def kernel_matrix(cells: SurfaceCells, radii: FloatingArray, distances: csr_matrix) -> csr_matrix:
    """Return Epanechnikov's kernel (cells, cells) around each cell, which maps mW on cells to
    mW/mm^2.

    The kernel is normalised by the surface's area under it, so that no light is lost at edges and
    on oblique cells.

    Args:
        radii: (cells,) kernel radii (mm).
        distances: those within these or larger radii, of `distances_within`.
    """
    rows = np.repeat(np.arange(cells.cells), np.diff(distances.indptr))
    weight = 1 - (distances.data / radii[rows]) ** 2
    kept = weight > 0
    rows, columns, weight = rows[kept], distances.indices[kept], weight[kept]
    weight /= np.bincount(rows, weight * cells.areas[columns], cells.cells)[rows]
    starts = np.concatenate([[0], np.bincount(rows, minlength=cells.cells).cumsum()])
    return csr_matrix((weight, columns, starts), shape=distances.shape)


def distances_within(cells: SurfaceCells, radii: FloatingArray) -> csr_matrix:
    """Return the distances, mm, of the cells around each cell that are closer than its radius, as a
    matrix (cells, cells) in ascending order.

    Cells with another orientation (`MIN_NORMAL_COSINE`) are left out. Cells with small radii are
    looked up by themselves: outside of the view they are many.
    """
    places, normals = cells.centres, cells.normals
    tree = cKDTree(places)
    narrow = radii <= np.sqrt(radii.min() * radii.max())
    found = []
    for part in (np.flatnonzero(narrow), np.flatnonzero(~narrow)):
        if len(part):
            pairs = cKDTree(places[part]).sparse_distance_matrix(
                tree, float(radii[part].max()), output_type="ndarray"
            )
            found.append((part[pairs["i"]], pairs["j"], pairs["v"]))
    rows, columns, distance = (np.concatenate(each) for each in zip(*found, strict=True))
    kept = distance < radii[rows]
    rows, columns, distance = rows[kept], columns[kept], distance[kept]
    alike = np.einsum("ij,ij->i", normals[rows], normals[columns]) > MIN_NORMAL_COSINE
    within = csr_matrix(
        (distance[alike], (rows[alike], columns[alike])), shape=(cells.cells, cells.cells)
    )
    within.sort_indices()
    return within


def product(matrix: csr_matrix, table: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the product (m, k) of a sparse matrix (m, n) and a table (n, k).

    Blocks of columns are multiplied one by one if the rows of the table that make one row of the
    result are too large for the processor's cache. Threads, as many as the renderer uses, share the
    blocks or the rows of a large product. The result does not depend on their number. For a table
    in which most bins of directions are empty, as those of few photons are, this takes half the
    time of a loop of Dr.Jit on the same processors, which gathers numbers one by one.
    """
    threads = min(dr.thread_count(), matrix.shape[0])
    shared = threads > 1 and matrix.nnz * table.shape[1] >= LEAST_SHARED_PRODUCT
    in_blocks = matrix.nnz / matrix.shape[0] * table.shape[1] * table.itemsize > CACHED_BYTES
    if not (shared or in_blocks):
        return np.asarray(matrix @ table)
    out = np.empty((matrix.shape[0], table.shape[1]), dtype=np.float32)

    def multiply_rows(rows: slice) -> None:
        out[rows] = matrix[rows] @ table

    def multiply_columns(columns: slice) -> None:
        out[:, columns] = matrix @ np.ascontiguousarray(table[:, columns])

    if in_blocks:
        work: Callable[[slice], None] = multiply_columns
        starts = np.append(np.arange(0, table.shape[1], BLOCK_COLUMNS), table.shape[1])
    else:
        work = multiply_rows
        # Each thread gets about as many weights as the others.
        starts = np.searchsorted(matrix.indptr, np.linspace(0, matrix.nnz, threads + 1))
        starts[0], starts[-1] = 0, matrix.shape[0]
    with ThreadPoolExecutor(threads if shared else 1) as pool:
        list(pool.map(work, map(slice, starts[:-1], starts[1:])))
    return out
