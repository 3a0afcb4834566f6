"""The photons of the pilot pass, and the estimates made from them before any image."""

from __future__ import annotations

from dataclasses import dataclass, fields

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from optisense.array_types import FloatingArray
from optisense.optics.backend.arrays import floats
from optisense.optics.scene.surface_cells import SurfaceCells, cell_at
from optisense.optics.transport.photon_map import GROUP_MASK, HALF_SHIFT, PhotonMap

GRAZING_COSINE = 0.25
"""Cosine of incidence (76 degrees) below which light is grazing. Light that passes 1 mm above a
place at such angles lands 4 mm or more behind it, so that the landings at the place do not
represent it."""
MIN_COSINE = 0.02
"""Lower bound on the cosine of incidence (89 degrees) when powers are divided by it, so that single
photons do not dominate the share of grazing light."""


@dataclass(frozen=True)
class PilotPhotons:
    """Landings of the pilot pass.

    Attributes:
        points: (n, 3) positions, mm.
        cosines: (n,) cosines of incidence.
        powers: (n,) powers, mW.
        groups: (n,) numbers of the light groups.
        halves: (n,) the half of the photons that each landing belongs to, 0 or 1.
    """

    points: FloatingArray
    cosines: FloatingArray
    powers: FloatingArray
    groups: NDArray[np.integer]
    halves: NDArray[np.integer]

    @classmethod
    def of(cls, photons: PhotonMap) -> PilotPhotons:
        """Return the landings of a photon pass."""
        places = np.asarray(photons.place)[: 4 * photons.count].reshape(-1, 4)
        travels = np.asarray(photons.travel)[: 4 * photons.count].reshape(-1, 4)
        width = 4 if photons.coloured else 1
        power = np.asarray(photons.power)[: width * photons.count].reshape(-1, width)
        bits = np.ascontiguousarray(places[:, 3]).view(np.uint32)
        return cls(
            places[:, :3],
            travels[:, 3],
            power[:, :3].mean(axis=1),
            bits & GROUP_MASK,
            (bits >> HALF_SHIFT) & 1,
        )

    def cells_of(self, cells: SurfaceCells) -> tuple[NDArray[np.integer], NDArray[np.bool_]]:
        """Return the cell (n,) of each landing, and a mask (n,) of those that lie in one."""
        point = mi.Point3f(*(floats(self.points[:, k]) for k in range(3)))
        cell, found = cell_at(cells, point, mi.Bool(True))
        dr.eval(cell, found)
        return np.asarray(cell), np.asarray(found)

    def within(self, cells: SurfaceCells, where: NDArray[np.bool_]) -> PilotPhotons:
        """Return the landings in the cells that the mask ``where`` (cells,) selects."""
        cell, found = self.cells_of(cells)
        kept = found & where[cell]
        return PilotPhotons(*(getattr(self, field.name)[kept] for field in fields(self)))

    def landed(self, cells: SurfaceCells, groups: int) -> FloatingArray:
        """Return the power (2, cells, groups), mW, on each cell for each half of the photons."""
        cell, found = self.cells_of(cells)
        rows = (self.halves.astype(np.int64) * cells.cells + cell) * groups + self.groups
        power = np.bincount(rows[found], self.powers[found], 2 * cells.cells * groups)
        return np.asarray(power, dtype=np.float64).reshape(2, -1, groups)

    def grazing_share(self) -> float:
        """Return the share of flux across the light that lands below `GRAZING_COSINE`."""
        across = self.powers / np.maximum(self.cosines, MIN_COSINE)
        grazing = self.cosines < GRAZING_COSINE
        return float(across[grazing].sum() / max(across.sum(), 1e-30))
