"""The radiance cache: light that falls on the undeformed opaque surfaces, by cell and direction.

The light that arrives at the sensing surface varies slowly from place to place. In a contact, only
the tilt of the surface and its shadows vary within a tenth of a millimetre. Photons are therefore
traced once per design, without contacts, and tallied where they land (see `tally`): each surface
cell and direction bin (see `DirectionBins`) keeps the flux through a plane *across the light* and
the mean direction. `shading` looks it up for visible points. The cost of an image then does not
depend on the number of photons.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import drjit as dr
import mitsuba as mi

from optisense.optics.radiance_cache.beams import Beams
from optisense.optics.scene.surface_cells import SurfaceCells


class Tables(NamedTuple):
    """Moments, heights and colours, as in `RadianceCache`."""

    moments: mi.Float
    heights: mi.Float
    colours: mi.Float


@dataclass
class RadianceCache:
    """The smoothed light of each cell, direction bin and light group, for lights of 1 mW.

    Attributes:
        cells: the surface cells.
        planes: number of planes that hold light: 1 for the surface, 2 with the raised plane above
            it (see `raised_plane`), whose entries follow those of the surface.
        bins: number of direction bins that hold light.
        groups: number of light groups.
        moments: four floats per entry: the flux density across the light (mW/mm^2) times the
            direction towards the light (3), and the flux density (1).
        heights: the flux density times the squared component of the direction along the bins' axis.
        colours: four floats per entry: the flux density in R, G, B where surfaces are coloured,
            else the same array as ``moments``.
        coloured: whether surfaces are coloured.
        roughness: GGX alpha of the sharpest metallic lobe of a coating; None without metal.
        narrow_lobes: whether a coating's lobe is narrower than most lamps.
        centres: the middle direction of each bin, and its number as bits; four floats each.
        irradiance: the table of `irradiance.irradiance_table`.
        beams: the same light in short lists of beams.
        photons: number of emitted photons.
        noise: relative RMS noise of the smoothed irradiance.
        worst_noise: relative RMS noise that the noisiest 5 % of the area have at least.
        above_surface: the same tables for the light half-way up the flux layer above the cells, if
            there is one (see `volume_flux`).
    """

    cells: SurfaceCells
    planes: int
    bins: int
    groups: int
    moments: mi.Float
    heights: mi.Float
    colours: mi.Float
    coloured: bool
    roughness: float | None
    narrow_lobes: bool
    centres: mi.Float
    irradiance: mi.Float
    beams: Beams
    photons: int
    noise: float
    worst_noise: float
    above_surface: Tables | None = None

    @property
    def metallic(self) -> bool:
        """Whether a coating has a metallic lobe."""
        return self.roughness is not None

    def binned(self) -> BinnedLight:
        """Return the light by direction bins."""
        return BinnedLight(
            cells=self.cells,
            planes=self.planes,
            tables=Tables(self.moments, self.heights, self.colours),
            above=self.above_surface,
            centres=self.centres,
            irradiance=self.irradiance,
            bins=dr.opaque(mi.UInt32, self.bins),
            groups=self.groups,
            coloured=self.coloured,
            narrow_lobes=self.narrow_lobes,
        )


@dataclass
class BinnedLight:
    """The part of a radiance cache that points on and near indenters read.

    Attributes:
        cells, planes, centres, irradiance, groups, coloured, narrow_lobes: as in `RadianceCache`.
        tables: the light on the surface.
        above: the light half-way up the flux layer, if there is one.
        bins: number of direction bins, as an opaque array.
    """

    cells: SurfaceCells
    planes: int
    tables: Tables
    above: Tables | None
    centres: mi.Float
    irradiance: mi.Float
    bins: mi.UInt32
    groups: int
    coloured: bool
    narrow_lobes: bool
