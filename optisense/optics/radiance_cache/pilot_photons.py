"""What the photons that teach the guide tell about the light, before any image."""

from __future__ import annotations

from dataclasses import dataclass, fields

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from optisense.optics.backend.arrays import floats
from optisense.optics.scene.surface_cells import SurfaceCells, cell_at
from optisense.optics.transport.photons import GROUP_MASK, HALF_SHIFT, PhotonMap

FloatArray = NDArray[np.floating]

GRAZING = 0.25
"""Cosine of landing below which what lands far behind a raised point is not what passes there."""
LEAST_CLEAR = 0.02
"""Cosines are raised to this, to tell how much of the light grazes."""


@dataclass(frozen=True)
class Scouts:
    """Landings: points (n, 3) mm, cosines (n,) with the surface's normal, powers (n,) mW, light
    groups (n,), and which half of the photons (n,) they are of, 0 or 1."""

    points: FloatArray
    cosines: FloatArray
    powers: FloatArray
    groups: NDArray[np.integer]
    halves: NDArray[np.integer]

    @classmethod
    def of(cls, photons: PhotonMap) -> Scouts:
        """Those of a pass."""
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
        """(n,) the cell that each landed in, and whether there is one."""
        point = mi.Point3f(*(floats(self.points[:, k]) for k in range(3)))
        cell, found = cell_at(cells, point, mi.Bool(True))
        dr.eval(cell, found)
        return np.asarray(cell), np.asarray(found)

    def within(self, cells: SurfaceCells, where: NDArray[np.bool_]) -> Scouts:
        """Those that landed in the cells that matter (cells,)."""
        cell, found = self.cells_of(cells)
        kept = found & where[cell]
        return Scouts(*(getattr(self, field.name)[kept] for field in fields(self)))

    def landed(self, cells: SurfaceCells, groups: int) -> FloatArray:
        """(2, cells, groups) mW on each cell, by the two halves."""
        cell, found = self.cells_of(cells)
        rows = (self.halves.astype(np.int64) * cells.cells + cell) * groups + self.groups
        power = np.bincount(rows[found], self.powers[found], 2 * cells.cells * groups)
        return np.asarray(power, dtype=np.float64).reshape(2, -1, groups)

    def grazing_share(self) -> float:
        """The part of their flux across the light which lands at a cosine below `GRAZING`."""
        across = self.powers / np.maximum(self.cosines, LEAST_CLEAR)
        grazing = self.cosines < GRAZING
        return float(across[grazing].sum() / max(across.sum(), 1e-30))
