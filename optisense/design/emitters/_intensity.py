"""Radiant intensity as a table over directions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from optisense.array_types import FloatingArray


@dataclass(frozen=True)
class Intensity:
    """Radiant intensity over the polar angle from the axis and the azimuth.

    Attributes:
        polar: polar angles (n,), degrees, ascending from 0.
        azimuth: azimuths (m,), degrees: 0 alone if the lamp is symmetric, else from 0 to 360.
        values: relative intensity (m, n), linear between the angles and 0 beyond the last one.
    """

    polar: FloatingArray
    azimuth: FloatingArray
    values: FloatingArray

    def at(self, polar: FloatingArray, azimuth: FloatingArray) -> FloatingArray:
        """Return the relative intensity (...) at polar angles and azimuths (...), degrees."""
        p = np.clip(np.interp(polar, self.polar, np.arange(len(self.polar))), 0, None)
        i = np.minimum(p.astype(int), max(len(self.polar) - 2, 0))
        f = p - i
        i1 = np.minimum(i + 1, len(self.polar) - 1)
        if len(self.azimuth) == 1:
            j = j1 = np.zeros(np.shape(polar), dtype=int)
            g = np.zeros(np.shape(polar))
        else:
            q = np.interp(np.mod(azimuth, 360.0), self.azimuth, np.arange(len(self.azimuth)))
            j = np.minimum(q.astype(int), len(self.azimuth) - 2)
            g, j1 = q - j, j + 1
        low = self.values[j, i] * (1 - f) + self.values[j, i1] * f
        high = self.values[j1, i] * (1 - f) + self.values[j1, i1] * f
        inside = (polar >= self.polar[0]) & (polar <= self.polar[-1])
        return np.where(inside, low * (1 - g) + high * g, 0.0)

    def without_azimuth(self) -> Intensity:
        """Return the table with one azimuth if it is symmetric about the axis, else itself."""
        if np.ptp(self.values, axis=0).max() > SYMMETRIC * self.values.max():
            return self
        return Intensity(self.polar, np.zeros(1), self.values[:1])


SYMMETRIC = 1e-9
"""Largest difference between azimuths, as a share of the peak, of a lamp that is symmetric about
its axis: rounding only."""
