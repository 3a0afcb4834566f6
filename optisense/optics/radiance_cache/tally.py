"""The tally of photons by cell, direction bin and light group, and the radiance cache made from it.

A photon adds the flux through a plane across its direction (its power over its cosine of incidence)
to the bin of its direction in the cell where it lands.
"""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix

from optisense.array_types import FloatingArray
from optisense.optics.backend.arrays import floats
from optisense.optics.radiance_cache._direction_bins import (
    COARSE_BINS,
    NARROW_LOBE,
    DirectionBins,
    Tables,
    bin_centres,
    direction_bin,
    dither,
    landing_bits,
)
from optisense.optics.radiance_cache._irradiance import irradiance_table
from optisense.optics.radiance_cache._power_rounding import PowerRounding
from optisense.optics.radiance_cache._raised_plane import areas, crossings
from optisense.optics.radiance_cache.beams import collect_beams
from optisense.optics.radiance_cache.cache import BinnedLight, RadianceCache
from optisense.optics.radiance_cache.smoothing import Kernels, Smoothing, product
from optisense.optics.scene.surface_cells import SurfaceCells, bin_axis, cell_at
from optisense.optics.transport.photon_map import GROUP_MASK, HALF_SHIFT, PhotonMap
from optisense.optics.transport.volume_flux import layer_cell_at

MIN_COSINE = 0.02
"""Lower bound on the cosine of incidence (89 degrees) that a photon's power is divided by, so that
an isolated grazing photon does not become a bright beam."""
EMPTY_BIN_SHARE = 1e-7
"""Share of all the light below which a direction bin counts as empty: a thousand such bins hold
0.01 % of the light."""
DENSE = 8000.0
"""Density of landed photons (1/mm^2) from which on the blur of the smoothing is undone in each
direction bin, where there is a raised plane; 8 million photons give GelSight Mini as much. In a
contact near its lamps, the error with 10 million is then 1.9 instead of 2.9 %, with 1.2 times the
noise."""
NOISIEST_SHARE = 0.05
"""Share of the area in view that counts as the worst places when their noise is reported: small
enough to find a dark corner, and large enough not to depend on a few cells."""
PATCH_AVERAGES = 4
"""Number of times that the squared noise is averaged with the smoothing kernel, which widens the
kernel twofold. Without averaging it is the square of a single difference, and chance would decide
which places are the worst."""
DARKEST_JUDGED = 0.1
"""Lower bound on the light to which a place's noise is relative, as a share of the mean light, so
that very dark places do not decide the result."""


class CacheTally:
    """Sums of photons per cell, direction bin and light group, over photon passes."""

    def __init__(
        self,
        kernels: Kernels,
        groups: int,
        coloured: bool,
        roughness: float | None,
        flux_cells: SurfaceCells | None = None,
        directions: DirectionBins = COARSE_BINS,
        planes: int = 1,
        curved: bool = False,
    ) -> None:
        """Prepare empty tables.

        Args:
            groups: number of light groups.
            coloured: whether powers are kept per colour channel.
            roughness: GGX alpha of the sharpest metallic lobe of a coating; None without metal.
            flux_cells: cells of the flux layer, in which light above the surface is tallied; None
                for none.
            planes: 2 to tally the light in the raised plane as well (see `raised_plane`), else 1.
            curved: whether surfaces are curved.
        """
        self.directions = directions
        self.planes = planes
        self.raised_areas = areas(kernels.cells) if planes > 1 and curved else None
        self.flux_cells = flux_cells
        self.roughness = roughness
        self.kernels = kernels
        self.cells = cells = kernels.cells
        self.groups = groups
        self.coloured = coloured
        self.passes = 0
        self.photons = 0
        entries = planes * cells.cells * directions.count * groups * 4
        self.landed = self._tables(entries)
        self.above_surface = None if flux_cells is None else self._tables(entries)
        # Power of the photons of even and of odd number in each plane; their difference gives the
        # noise. A cell receives more photons than single precision adds exactly.
        self.halves = dr.zeros(mi.Float64, planes * 2 * cells.cells * groups)

    def _tables(self, entries: int) -> Tables:
        moments = dr.zeros(mi.Float, entries)
        colours = dr.zeros(mi.Float, entries if self.coloured else 4)
        return Tables(moments, dr.zeros(mi.Float, entries // 4), colours)

    def add(self, photons: PhotonMap) -> None:
        """Add the photons of a pass. All passes must have the same number of photons."""
        self._tally(photons, self.landed, None)
        if self.above_surface is not None and photons.passing is not None:
            self._tally(photons.passing, self.above_surface, self.flux_cells)
        self.passes += 1
        self.photons += photons.emitted
        dr.eval(self.landed, self.halves, self.above_surface)

    def _tally(self, photons: PhotonMap, tables: Tables, flux_cells: SurfaceCells | None) -> None:
        """Add photons that landed, or that crossed a flux layer, to tables."""
        index = dr.arange(mi.UInt32, photons.count)
        place = dr.gather(mi.Vector4f, photons.place, index)
        travel = dr.gather(mi.Vector4f, photons.travel, index)
        bits = dr.reinterpret_array(mi.UInt32, place.w)
        point = mi.Point3f(place.x, place.y, place.z)
        if flux_cells is None:
            cell, found = cell_at(self.cells, point, mi.Bool(True))
            across = dr.rcp(dr.maximum(travel.w, MIN_COSINE))
        else:
            cell, _, found = layer_cell_at(flux_cells, point, mi.Bool(True))
            across = dr.rcp(dr.maximum(travel.w, 1e-6))
        direction = mi.Vector3f(travel.x, travel.y, travel.z)
        count = dr.opaque(mi.UInt32, self.directions.count)
        random = landing_bits(place, direction)
        beside = dither(random, self.directions)
        in_quanta = PowerRounding.of(photons.emitted_power, random)
        bin_ = direction_bin(self.cells, self.directions, -direction, *beside)
        group = bits & GROUP_MASK
        power = mi.Vector4f(0)
        if self.coloured:
            power = dr.gather(mi.Vector4f, photons.power, index)
            scalar = (power.x + power.y + power.z) * (1 / 3)
        else:
            scalar = dr.gather(mi.Float, photons.power, index)
        kept = across * in_quanta.kept(scalar * across)
        flux = scalar * kept
        height = dr.dot(direction, bin_axis(self.cells, 2))
        rows = [(cell, mi.Float(1), found)]
        if self.planes > 1:
            crossed, relative, crosses = crossings(
                self.cells, cell, point, direction, travel.w, found, self.raised_areas
            )
            rows.append((crossed + dr.opaque(mi.UInt32, self.cells.cells), relative, crosses))
        for row, relative, counts in rows:
            entry = (row * count + bin_) * self.groups + group
            if self.coloured:
                for k in range(3):
                    value = in_quanta(power[k] * kept * relative)
                    dr.scatter_add(tables.colours, value, entry * 4 + k, counts)
            for k in range(3):
                value = in_quanta(-direction[k] * flux * relative)
                dr.scatter_add(tables.moments, value, entry * 4 + k, counts)
            dr.scatter_add(tables.moments, in_quanta(flux * relative), entry * 4 + 3, counts)
            dr.scatter_add(
                tables.heights, in_quanta(dr.square(height) * flux * relative), entry, counts
            )
        if flux_cells is not None:
            return
        half = (bits >> HALF_SHIFT) & 1
        for plane, (row, relative, counts) in enumerate(rows):
            place = row + (half + plane) * dr.opaque(mi.UInt32, self.cells.cells)
            value = mi.Float64(in_quanta(scalar * relative))
            dr.scatter_add(self.halves, value, place * self.groups + group, counts)

    def noise(self) -> float:
        """Return the relative RMS noise of the smoothed irradiance (1 = 100 %).

        The noise is estimated from the difference between two halves of the photons. It is the RMS
        over all cells in or near the camera's view and all light groups, relative to each group's
        mean; infinite without photons.
        """
        if self.passes < 1:
            return float("inf")
        near = self.kernels.near
        return relative_noise(*(values[near] for values in self._light_and_variance()))

    def worst_noise(self) -> float:
        """Return the relative RMS noise (1 = 100 %) that the noisiest 5 % of the area have at
        least.

        The area is that in or near the camera's view, and the noise of each place is relative to
        the light there. Light groups have equal weights, each relative to its own mean. The result
        is infinite without photons.
        """
        if self.passes < 1:
            return float("inf")
        kernel = self._smoothing().kernel
        near, areas = self.kernels.near, self.cells.areas
        return noise_of_worst_places(*self._light_and_variance(), near, areas, kernel)

    def _light_and_variance(self) -> tuple[FloatingArray, FloatingArray]:
        """Return the smoothed irradiance (cells, groups), mW/mm^2, and its variance."""
        kernel = self._smoothing()
        means = [kernel.kernel @ landed for landed in self._landed()[0]]
        if kernel.correction is not None:
            means = [kernel.correction @ light for light in means]
        # Half the difference of two halves has the same standard deviation as their mean.
        return (means[0] + means[1]) / 2, ((means[0] - means[1]) / 2) ** 2

    def _products(self, tables: Tables, kernel: Smoothing, used: NDArray[np.integer]) -> Tables:
        """Return the smoothed light of the bins ``used``, deblurred by bins if the kernel has a
        correction, else by one factor for each cell and group.
        """
        cells, count = self.cells.cells, self.directions.count
        once = (kernel.kernel / self.passes).astype(np.float32)
        near, twice, factors = np.flatnonzero(self.kernels.near), None, None
        if kernel.correction is None:
            landed = self._landed().mean(axis=1)
            factors = [self.kernels.sharpening(each, self.photons) for each in landed]
        else:
            # Elsewhere the correction is the identity; a copy of a table takes as long as a
            # product.
            twice = kernel.correction[near].astype(np.float32)

        def summed(table: mi.Float) -> mi.Float:
            planes = []
            for plane, whole in enumerate(np.asarray(table).reshape(self.planes, cells, count, -1)):
                chosen = whole if len(used) == count else np.take(whole, used, axis=1)
                light = product(once, chosen.reshape(cells, -1))
                if twice is not None:
                    light[near] = product(twice, light)
                elif factors is not None:
                    groups = light.reshape(cells, len(used), self.groups, -1)
                    groups *= factors[plane].astype(np.float32)[:, None, :, None]
                planes.append(light)
            return floats(planes[0] if len(planes) == 1 else np.stack(planes))

        moments, heights = summed(tables.moments), summed(tables.heights)
        return Tables(moments, heights, summed(tables.colours) if self.coloured else moments)

    def _smoothing(self) -> Smoothing:
        dense = self.planes > 1 and self.kernels.density * self.photons >= DENSE
        return self.kernels.smoothing(self.photons, self.directions.corrected or dense)

    def _landed(self) -> FloatingArray:
        """Return the power (planes, 2, cells, groups), mW, of photons of even and odd number."""
        halves = np.asarray(self.halves, dtype=np.float64) * (2 / self.passes)
        return halves.reshape(self.planes, 2, -1, self.groups)

    def smoothed(self) -> RadianceCache:
        """Return the radiance cache of the photons so far; only bins that hold light are kept."""
        count = self.directions.count
        power = np.zeros(count)
        for tables in (self.landed, self.above_surface):
            if tables is not None:
                fluxes = np.asarray(tables.moments)[3::4].reshape(-1, count, self.groups)
                power += fluxes.sum(axis=0).sum(axis=1)
        used = np.flatnonzero(power > EMPTY_BIN_SHARE * power.sum())
        used = used if len(used) else np.zeros(1, dtype=np.int64)
        kernel = self._smoothing()
        tables = self._products(self.landed, kernel, used)
        above = self.above_surface
        if above is not None:
            above = self._products(above, kernel, used)
        size = dr.opaque(mi.UInt32, len(used))
        cells, groups = self.cells.cells, self.groups
        table = irradiance_table(tables.moments, cells, size, groups)
        dr.eval(tables, table, above)
        across = self.directions.across
        binned = BinnedLight(
            cells=self.cells,
            planes=self.planes,
            tables=tables,
            above=above,
            centres=bin_centres(self.cells, self.directions, used),
            irradiance=table,
            bins=size,
            groups=groups,
            coloured=self.coloured,
            narrow_lobes=self.roughness is not None and self.roughness < NARROW_LOBE,
        )
        return RadianceCache(
            binned=binned,
            beams=collect_beams(tables, self.coloured, used, across, cells, groups),
            roughness=self.roughness,
            photons=self.photons,
            noise=self.noise(),
            worst_noise=self.worst_noise(),
        )


def relative_noise(light: FloatingArray, square: FloatingArray) -> float:
    """Return the relative RMS noise (1 = 100 %) over cells and light groups.

    Args:
        light: (cells, groups) irradiance, mW/mm^2.
        square: (cells, groups) its squared standard deviation.
    """
    scale = light.mean(axis=0)
    lit = scale > 0
    if not lit.any():
        return 0.0
    return float(np.sqrt((square[:, lit] / scale[lit] ** 2).mean()))


def noise_of_worst_places(
    light: FloatingArray,
    square: FloatingArray,
    near: NDArray[np.bool_],
    areas: FloatingArray,
    kernel: csr_matrix,
) -> float:
    """Return the relative RMS noise (1 = 100 %) that the noisiest 5 % of the area have at least.

    Args:
        light: (cells, groups) irradiance, mW/mm^2.
        square: (cells, groups) its squared standard deviation.
        near: (cells,) mask of the cells that count.
        areas: (cells,) areas, mm^2.
        kernel: (cells, cells) the kernel that smooths the light.
    """
    scale = light[near].mean(axis=0)
    lit = scale > 0
    if not lit.any():
        return 0.0
    noise = (square[:, lit] / scale[lit] ** 2).mean(axis=1)
    brightness = (light[:, lit] / scale[lit]).mean(axis=1)
    for _ in range(PATCH_AVERAGES):
        noise = kernel @ (noise * areas)
    relative = np.sqrt(noise[near]) / np.maximum(brightness[near], DARKEST_JUDGED)
    order = np.argsort(relative)
    share = np.cumsum(areas[near][order]) / areas[near].sum()
    return float(relative[order][np.searchsorted(share, 1.0 - NOISIEST_SHARE)])
