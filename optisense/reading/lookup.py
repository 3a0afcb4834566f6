"""A fast, deterministic reader of tilts.

The change of colour by tilt is measured in ball presses at several places, interpolated to other
places by regression, and looked up. The usual readers for real sensors are networks
(`optisense.tasks._colour_to_normal`). Their training takes seconds and many presses, and its result
depends on the seed. This reader is made for objectives, which read nine presses, thousands of times
in a search:

1. *A table for each press* (`PressTable`): the mean change of colour, from the untouched picture,
   at each tilt of a grid, by the kernel regression of Nadaraya and Watson (1964) with a Gaussian.
2. *A table for each pixel* (`TiltLookup`): at each tilt, the change of a channel is a quadratic
   function of the place in the picture and a linear one of the untouched level there, fitted to the
   presses by ridge regression (Hoerl and Kennard 1970). The distance of each press from the fit to
   the others estimates the uncertainty of the fit.
3. *The posterior mean*: the likelihood of each tilt follows from the noise of the camera and that
   uncertainty, both assumed to be Gaussian, and the result is the mean normal weighted with it.
   Where colours contain little information, it is near the middle of all tilts, the best estimate
   without any.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from optisense.array_types import FloatArray

CELL = 3.0
"""Angle (degrees) between neighbouring tilts of the grid: fine enough for the errors of sensors, 2
degrees and more, as results lie between the tilts of the grid."""

CELL_VARIANCE = CELL**2 / 12.0
"""Variance (degrees squared) along an axis of the tilts within a cell of the grid."""

WIDTH = 2.0
"""Standard deviation (degrees) of the Gaussian over which changes of colour are averaged."""

LEAST_WEIGHT = 0.01
"""Smallest sum of the weights of presses with which a tilt counts as known; a smaller sum is the
far tail of the Gaussian of a neighbouring tilt."""

SLOPE_PENALTY = 0.1
"""Penalty of the linear terms in the regression, in units of a press's weight: a tenth, which has
an effect only for tilts that few presses show."""

CURVE_PENALTY = 1.0
"""Penalty of the quadratic terms, in units of a press's weight. Without it, eight presses determine
seven terms poorly; errors on GelSight Mini with 0.1 are within a few hundredths of those with 1."""

LEAST_SPREAD = 1.0
"""Value (levels of 255) added to the spread of the untouched levels, by which they are scaled, so
that differences below the camera's noise have no effect."""

ROUNDING_VARIANCE = 1.0 / 12.0
"""Variance of rounding to whole levels: of the uniform distribution over one level."""

LEVEL_SHARE = 0.3
"""Prior probability that skin is not tilted: about the share of the box around a round contact that
lies outside the contact (1 - pi / 4), and the middle of the ball."""

MOST_LEVERAGE = 0.8
"""Upper bound on the leverage of a press in the computation of its distance from the fit to the
others: at 1 it alone determines the fit there, and the distance is unknown."""


@dataclass(frozen=True)
class Pixels:
    """The data of n pixels of a picture.

    Attributes:
        picture: (n, 3) values that the camera stored, levels of 255.
        untouched: (n, 3) values of the untouched sensor without noise, levels of 255.
        places: (n, 2) positions in the picture, -1 to 1 across its width and height.
    """

    picture: FloatArray
    untouched: FloatArray
    places: FloatArray

    def __getitem__(self, some: slice) -> Pixels:
        """Return a slice of the pixels."""
        return Pixels(self.picture[some], self.untouched[some], self.places[some])


def tilt_grid(steepest: float) -> FloatArray:
    """Return the tilts (k, 2), degrees, of a square grid of `CELL`, up to the steepest.

    A tilt is the angle between the normal and the untouched one, along the direction of the tilt
    (azimuthal equidistant).
    """
    most = np.ceil(steepest / CELL) * CELL
    steps = np.arange(-most, most + CELL / 2, CELL)
    grid = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    return grid[np.linalg.norm(grid, axis=1) <= steepest + CELL / 2]


def tilts_to_normals(tilts: FloatArray) -> FloatArray:
    """Return the unit normals (..., 3) of tilts (..., 2), degrees; z is the untouched normal."""
    angle = np.radians(np.linalg.norm(tilts, axis=-1, keepdims=True))
    along = np.radians(tilts) * np.sinc(angle / np.pi)
    return np.concatenate([along, np.cos(angle)], axis=-1)


def normals_to_tilts(normals: FloatArray) -> FloatArray:
    """Return the tilts (..., 2), degrees, of unit normals: the inverse of `tilts_to_normals`."""
    sine = np.linalg.norm(normals[..., :2], axis=-1, keepdims=True)
    angle = np.degrees(np.arctan2(sine, normals[..., 2:]))
    return normals[..., :2] / np.maximum(sine, 1e-12) * angle


def tilt_kernel(tilts: FloatArray, grid: FloatArray) -> FloatArray:
    """Return the weights (k, n) of pixels of known tilts (n, 2) at each tilt of a grid (k, 2)."""
    square = ((grid[:, None] - tilts) ** 2).sum(axis=2)
    return np.exp(-0.5 * square / WIDTH**2)


@dataclass(frozen=True)
class PressTable:
    """The change of colour by a press, at each tilt of a grid.

    Attributes:
        change: (k, 3) change of colour, levels of 255.
        within: (k, 3) variance of the change over a cell of the grid, levels squared; it is the
            variance over the Gaussian, reduced to the size of a cell.
        weight: (k,) reliability of each change, 0 to 1.
        place: (2,) mean position of its pixels.
        untouched: (3,) mean untouched level of its pixels.
    """

    change: FloatArray
    within: FloatArray
    weight: FloatArray
    place: FloatArray
    untouched: FloatArray

    @classmethod
    def of(cls, pixels: Pixels, kernel: FloatArray) -> PressTable:
        """Return the table of the n pixels of a contact, with their `tilt_kernel` (k, n)."""
        weight = kernel.sum(axis=1)
        share = kernel / np.maximum(weight, 1e-12)[:, None]
        each = pixels.picture - pixels.untouched
        change = share @ each
        return cls(
            change=change,
            within=np.maximum(share @ each**2 - change**2, 0.0) * CELL_VARIANCE / WIDTH**2,
            weight=np.minimum(1.0, weight),
            place=pixels.places.mean(axis=0),
            untouched=pixels.untouched.mean(axis=0),
        )


class TiltLookup:
    """A reader of tilts at any place, from tables of presses at several places."""

    def __init__(self, tables: Sequence[PressTable], grid: FloatArray, noise: float) -> None:
        """Fit the tables.

        Args:
            tables: tables of the known presses, with a common grid.
            grid: (k, 2) tilts of this grid, degrees.
            noise: standard deviation of the camera's noise, levels of 255.
        """
        weights = np.array([each.weight for each in tables])
        known = weights.sum(axis=0) >= LEAST_WEIGHT
        self._weights = weights[:, known]
        self._tilts = grid[known]
        self._places = np.array([each.place for each in tables])
        self._reach = np.maximum(np.abs(self._places).max(axis=0), 0.1)
        self._levels = np.array([each.untouched for each in tables])
        self._noise = noise**2 + ROUNDING_VARIANCE
        changes = np.array([each.change[known] for each in tables])
        within = np.array([each.within[known] for each in tables])
        self._fits = [
            self._fit(changes[..., channel], within[..., channel], channel) for channel in range(3)
        ]
        self._normals = np.concatenate([tilts_to_normals(self._tilts), [[0.0, 0.0, 1.0]]])

    def normals(self, pixels: Pixels) -> FloatArray:
        """Return the read normals (n, 3), in the frame whose third axis is the untouched normal."""
        scores = np.empty((len(pixels.picture), len(self._tilts) + 1), dtype=np.float32)
        scores[:, :-1] = 2.0 * np.log((1.0 - LEVEL_SHARE) / max(len(self._tilts), 1))
        scores[:, -1] = 2.0 * np.log(LEVEL_SHARE)
        for channel, (coefficients, variance) in enumerate(self._fits):
            seen, untouched = pixels.picture[:, channel], pixels.untouched[:, channel]
            terms = self._terms(pixels.places, untouched, channel).astype(np.float32)
            level = terms @ coefficients.T.astype(np.float32)
            level += untouched[:, None].astype(np.float32)
            np.clip(level, 0.0, 255.0, out=level)
            level -= seen[:, None].astype(np.float32)
            spread = (self._noise + variance).astype(np.float32)
            scores[:, :-1] -= level**2 / spread + np.log(spread)
            scores[:, -1] -= (seen - untouched) ** 2 / self._noise + np.log(self._noise)
        scores -= scores.max(axis=1, keepdims=True)
        mean = np.exp(0.5 * scores) @ self._normals.astype(np.float32)
        found = mean.astype(np.float64)
        return found / np.linalg.norm(found, axis=1, keepdims=True)

    def _terms(self, places: FloatArray, levels: FloatArray, channel: int) -> FloatArray:
        """Return the terms (n, 7) of the regression of a channel's change."""
        x, y = (places / self._reach).T
        known = self._levels[:, channel]
        level = (levels - known.mean()) / (known.std() + LEAST_SPREAD)
        return np.stack([np.ones_like(x), x, y, level, x**2 - 0.5, y**2 - 0.5, x * y], axis=1)

    def _fit(
        self, change: FloatArray, within: FloatArray, channel: int
    ) -> tuple[FloatArray, FloatArray]:
        """Return the coefficients (k, 7) at each tilt, and the fit's variance (k,), levels^2."""
        terms = self._terms(self._places, self._levels[:, channel], channel)
        weights = self._weights
        penalty = np.diag([1e-9, *[SLOPE_PENALTY] * 3, *[CURVE_PENALTY] * 3])
        inverse = np.linalg.inv(np.einsum("jk,ja,jb->kab", weights, terms, terms) + penalty)
        sums = np.einsum("jk,ja,jk->ka", weights, terms, change)
        coefficients = np.einsum("kab,kb->ka", inverse, sums)
        # The distance from the fit to the other presses follows from that to the complete fit.
        leverage = weights * np.einsum("ja,kab,jb->jk", terms, inverse, terms)
        distance = (change - terms @ coefficients.T) / (1.0 - np.minimum(leverage, MOST_LEVERAGE))
        variance = (weights * (distance**2 + within)).sum(axis=0) / weights.sum(axis=0)
        return coefficients, variance
