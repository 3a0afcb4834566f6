"""The direction bins in which a radiance cache keeps light, and their resolution."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from optisense.optics.backend.arrays import floats
from optisense.optics.backend.sequences import unit_float
from optisense.optics.scene.surface_cells import SurfaceCells, bin_axis


class Tables(NamedTuple):
    """Light by cell, direction bin and light group.

    Attributes:
        moments: four floats per entry: the flux density across the light (mW/mm^2) times the
            direction towards the light (3), and the flux density (1).
        heights: the flux density times the squared component of the direction along the bins' axis.
        colours: four floats per entry: the flux density in R, G, B where surfaces are coloured,
            else the same array as ``moments``.
    """

    moments: mi.Float
    heights: mi.Float
    colours: mi.Float


@dataclass(frozen=True)
class DirectionBins:
    """Bins of equal solid angle: bands about the mean normal of the surfaces, each divided into as
    many sectors of azimuth as there are bands.

    With sharp edges between bins, a point above the surface would count a lamp near an edge twice
    or not at all; sums over overlapping bins hardly depend on the position of the edges.

    Attributes:
        across: number of bands, and of sectors in each; even.
        overlap: half-width, in bins, of the triangular density by which directions are spread over
            neighbouring bins. With 1, each bin is weighted with a quadratic B-spline.
        corrected: whether the blur of the smoothing is undone in each bin, instead of in the sum of
            all bins.
    """

    across: int
    overlap: float
    corrected: bool = False

    @property
    def count(self) -> int:
        """Number of bins."""
        return self.across * self.across

    @property
    def fine(self) -> bool:
        """Whether the bins are fine enough for narrow lobes."""
        return self.across >= FINE_BINS.across

    @classmethod
    def for_coating(
        cls, roughness: float | None, curved: bool = False, raised_plane: bool = False
    ) -> DirectionBins:
        """Return the bins for coatings.

        Args:
            roughness: GGX alpha of the sharpest metallic lobe; None for diffuse coatings.
            curved: whether the coated surfaces are curved and not lit by grazing light (the volume
                flux describes how grazing light varies).
            raised_plane: whether the light in the raised plane is tallied where bins are coarse.
        """
        broad = BROAD_LOBE_OF_RAISED_PLANE if raised_plane else BROAD_LOBE
        if roughness is None or roughness >= broad:
            return CURVED_BINS if curved else COARSE_BINS
        return FINE_BINS if roughness >= FINEST_LOBE else FINEST_BINS


COARSE_BINS = DirectionBins(16, 0.6)
"""The bins for diffuse coatings and broad metallic lobes. With full overlap, the skin beside a
contact of GelSight Mini of specularity 0.3 is 2.5 % off instead of 1.8 %."""
CURVED_BINS = DirectionBins(18, 0.6, True)
"""The bins for diffuse coatings and broad lobes on curved surfaces, in front of which light varies
faster. In a contact of the diffuse spherical GelSight Mini the RMS error over patches is 3.1 % with
16 x 16 bins and 1.3 % with these, whose light takes a quarter longer (see docs/performance.md)."""
FINE_BINS = DirectionBins(24, 0.6, True)
"""The bins for lobes that resolve the lamps: 576 bins, 8.5 degrees across in the mean."""
FINEST_BINS = DirectionBins(32, 0.6, True)
"""The bins for lobes of a few degrees: 1,024 bins, 6.3 degrees across in the mean."""
BROAD_LOBE = 0.5
"""GGX alpha from which on a lobe is so broad that coarse bins suffice where no light is tallied in
the raised plane."""
BROAD_LOBE_OF_RAISED_PLANE = 0.38
"""The same where the light in the raised plane is tallied. At 0.4, coarse bins leave an error of
1.5 % in a contact in the middle of GelSight Mini and 1.0 % beside it; `FINE_BINS`, which take twice
the time at equal noise, leave 1.3 and 0.7 %."""
NARROW_LOBE = 0.25
"""GGX alpha below which a lobe is narrower than most lamps and sees each beam as two discs (see
`two_discs`)."""
FINEST_LOBE = 0.18
"""GGX alpha below which the finest bins are needed. At 0.2, the error in a contact of GelSight Mini
is 2.1 % with `FINE_BINS` and 1.9 % with `FINEST_BINS`, and an image takes 0.7 times as long with
the former; at 0.05, it is 9 and 5 %."""


def direction_bin(
    cells: SurfaceCells,
    bins: DirectionBins,
    direction: mi.Vector3f,
    bands_off: mi.Float,
    sectors_off: mi.Float,
) -> mi.UInt32:
    """Return the number (n,) of the bin of a direction, offset by a number of bands and sectors.

    Args:
        cells: the surface cells, whose frame is that of the bins.
        direction: unit vectors.
        bands_off: offset in bands, added before rounding.
        sectors_off: offset in sectors, added before rounding.
    """
    x, y, z = (dr.dot(direction, bin_axis(cells, k)) for k in range(3))
    across = dr.opaque(mi.Float, float(bins.across))
    last = mi.UInt32(across) - 1
    place = (z + 1) * (across / 2) + bands_off
    # A place beyond a pole is reflected at the pole.
    place = dr.select(place > across, 2 * across - place, dr.abs(place))
    band = dr.minimum(mi.UInt32(place), last)
    turn = dr.atan2(y, x) * (1 / dr.two_pi) + sectors_off / across
    turn -= dr.floor(turn)
    return band * mi.UInt32(across) + dr.minimum(mi.UInt32(turn * across), last)


def landing_bits(place: mi.Vector4f, direction: mi.Vector3f) -> tuple[mi.UInt32, mi.UInt32]:
    """Return two sets of random bits (n,) that depend on a landing alone, as landings are recorded
    in no fixed order.

    Args:
        place: four floats of each landing, as in `PhotonMap.place`.
        direction: the unit direction in which each photon travels.
    """
    first, second, third = (
        dr.reinterpret_array(mi.UInt32, value) for value in (place.x, place.y, direction.x)
    )
    one, other = mi.sample_tea_32(first ^ (third * 747796405), second)
    return one, other


def dither(random: tuple[mi.UInt32, mi.UInt32], bins: DirectionBins) -> tuple[mi.Float, mi.Float]:
    """Return random offsets (n,) in bands and (n,) in sectors, with a triangular density over the
    overlap of bins.

    Args:
        random: the random bits of each photon (see `landing_bits`).
    """
    overlap = dr.opaque(mi.Float, bins.overlap)
    one, other = (
        overlap * (unit_float(each) + unit_float(each * 277803737) - 1) for each in random
    )
    return one, other


def bin_centres(cells: SurfaceCells, bins: DirectionBins, chosen: NDArray[np.integer]) -> mi.Float:
    """Return four floats for each of the chosen bins (k,): its middle direction, and its number as
    bits; (4 k,) in all.
    """
    z = (chosen // bins.across + 0.5) * (2 / bins.across) - 1
    turn = (chosen % bins.across + 0.5) * (2 * np.pi / bins.across)
    flat = np.sqrt(1 - z * z)
    local = np.stack([flat * np.cos(turn), flat * np.sin(turn), z], axis=1)
    out = np.zeros((len(chosen), 4), dtype=np.float32)
    out[:, :3] = local @ cells.axes
    out[:, 3] = chosen.astype(np.uint32).view(np.float32)
    return floats(out)
