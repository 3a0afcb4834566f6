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

import mitsuba as mi

from optisense.optics.radiance_cache._direction_bins import Tables
from optisense.optics.radiance_cache.beams import Beams
from optisense.optics.scene.surface_cells import SurfaceCells


@dataclass
class BinnedLight:
    """The smoothed light of each cell, direction bin and light group, for lights of 1 mW.

    Points on and near indenters read it; other points read beams.

    Attributes:
        cells: the surface cells.
        planes: number of planes that hold light: 1 for the surface, 2 with the raised plane above
            it (see `raised_plane`), whose entries follow those of the surface.
        tables: the light on the surface.
        above: the light half-way up the flux layer above the cells, if there is one (see
            `volume_flux`).
        centres: the middle direction of each bin, and its number as bits; four floats each.
        irradiance: the table of `irradiance.irradiance_table`.
        bins: number of direction bins that hold light, as an opaque array.
        groups: number of light groups.
        coloured: whether surfaces are coloured.
        narrow_lobes: whether a coating's lobe is narrower than most lamps.
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


@dataclass
class RadianceCache:
    """The light on the undeformed surfaces, for lights of 1 mW.

    Attributes:
        binned: the light by cell, direction bin and light group.
        beams: the same light in short lists of beams.
        roughness: GGX alpha of the sharpest metallic lobe of a coating; None without metal.
        photons: number of emitted photons.
        noise: relative RMS noise of the smoothed irradiance.
        worst_noise: relative RMS noise that the noisiest 5 % of the area have at least.
        traced_lobes: whether the peaks of metallic lobes are traced (see `traced_lobes`), so that
            only their tails read the cache.
    """

    binned: BinnedLight
    beams: Beams
    roughness: float | None
    photons: int
    noise: float
    worst_noise: float
    traced_lobes: bool = False

    @property
    def metallic(self) -> bool:
        """Whether a coating has a metallic lobe."""
        return self.roughness is not None
