"""A reader of tilts that is fast and draws no random numbers: the change of colour by tilt, as ball
presses at several places show it, carried to other places by regression, and looked up.

Readers that users fit to real sensors are networks (`optisense.tasks.colour_to_normal`). Their
training takes seconds and many presses, and ends elsewhere with each seed. This one is made for
objectives, which read nine presses, thousands of times in a search:

1. *A table for each press* (`PressTable`): the mean change of colour, from the untouched picture,
   at each tilt of a grid, by the kernel regression of Nadaraya and Watson (1964) with a Gaussian.
2. *A table for each pixel* (`TiltLookup`): at each tilt, the change of a channel is a quadratic
   function of the place in the picture and a linear one of the untouched level there, fitted to
   the presses by ridge regression (Hoerl and Kennard 1970). How far each press lies off the fit to
   the others tells how uncertain it is.
3. *The mean of what is likely*: the likelihood of each tilt follows from the noise of the camera
   and that uncertainty, both taken for Gaussian, and what is read is the mean normal by it. Where
   colours tell little, that is near the middle of all tilts, which is the best that can be said.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

CELL = 3.0
"""Degrees between neighbouring tilts of the grid: fine enough for the errors that sensors have, of
2 degrees and more, as what is read lies between them."""

CELL_VARIANCE = CELL**2 / 12.0
"""Degrees squared: the variance along an axis of tilts that are nearest to one of the grid."""

WIDTH = 2.0
"""Degrees, the standard deviation of the Gaussian over which changes of colour are averaged."""

LEAST_WEIGHT = 0.01
"""Sum of the weights of presses from which on a tilt counts as known; less is the far tail of the
Gaussian of a neighbouring tilt."""

SLOPE_PENALTY = 0.1
"""Penalty of the linear terms in the regression, in presses: a tenth of one, which only matters
where a tilt is seen by few presses."""

CURVE_PENALTY = 1.0
"""Penalty of the quadratic terms, in presses. Eight presses decide seven terms badly without one;
errors on GelSight Mini with 0.1 are within a few hundredths of those with 1."""

LEAST_SPREAD = 1.0
"""Levels of 255, added to the spread of the untouched levels that scales them: differences that the
camera's noise hides should not decide anything."""

ROUNDING_VARIANCE = 1.0 / 12.0
"""Variance of rounding to whole levels: of the uniform distribution over one level."""

LEVEL_SHARE = 0.3
"""The share of skin that is not tilted at all among what is read, before any colour is seen: about
that of the box around a round contact which the contact leaves free (1 - pi / 4), and the middle of
the ball."""

MOST_LEVERAGE = 0.8
"""Leverage of a press from which on its distance from the others' fit is no more enlarged: at 1 it
decides the fit there alone, and the distance is unknown."""


@dataclass(frozen=True)
class Pixels:
    """Pixels of a picture, n of them.

    Attributes:
        picture: (n, 3) levels of 255, what the camera stored.
        untouched: (n, 3) levels where nothing touches, without noise.
        places: (n, 2) in the picture, -1 to 1 across its width and height.
    """

    picture: FloatArray
    untouched: FloatArray
    places: FloatArray

    def __getitem__(self, some: slice) -> Pixels:
        """Some of them."""
        return Pixels(self.picture[some], self.untouched[some], self.places[some])


def tilt_grid(steepest: float, cell: float = CELL) -> FloatArray:
    """(k, 2) degrees: tilts of a square grid, up to the steepest. A tilt is the angle between the
    normal and the untouched one, along the direction to which it leans (azimuthal equidistant).
    """
    most = np.ceil(steepest / cell) * cell
    steps = np.arange(-most, most + cell / 2, cell)
    grid = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    return grid[np.linalg.norm(grid, axis=1) <= steepest + cell / 2]


def tilts_to_normals(tilts: FloatArray) -> FloatArray:
    """(..., 3): unit normals of tilts (..., 2); the third axis is the untouched normal."""
    angle = np.radians(np.linalg.norm(tilts, axis=-1, keepdims=True))
    along = np.radians(tilts) * np.sinc(angle / np.pi)
    return np.concatenate([along, np.cos(angle)], axis=-1)


def normals_to_tilts(normals: FloatArray) -> FloatArray:
    """(..., 2) degrees: the inverse of `tilts_to_normals`."""
    sine = np.linalg.norm(normals[..., :2], axis=-1, keepdims=True)
    angle = np.degrees(np.arctan2(sine, normals[..., 2:]))
    return normals[..., :2] / np.maximum(sine, 1e-12) * angle


def tilt_kernel(tilts: FloatArray, grid: FloatArray) -> FloatArray:
    """(k, n): how much pixels of known tilts (n, 2) count at each tilt of a grid (k, 2)."""
    square = ((grid[:, None] - tilts) ** 2).sum(axis=2)
    return np.exp(-0.5 * square / WIDTH**2)


@dataclass(frozen=True)
class PressTable:
    """The change of colour by a press, at each tilt of a grid.

    Attributes:
        change: (k, 3) levels of 255.
        within: (k, 3) its variance over a cell of the grid, levels squared: that over the Gaussian,
            as far as a cell is narrower.
        weight: (k,) 0 to 1, how well each is known.
        place: (2,) the middle of its pixels.
        untouched: (3,) their mean untouched level.
    """

    change: FloatArray
    within: FloatArray
    weight: FloatArray
    place: FloatArray
    untouched: FloatArray

    @classmethod
    def of(cls, pixels: Pixels, kernel: FloatArray) -> PressTable:
        """The table of the n pixels of a contact, with their `tilt_kernel` (k, n)."""
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
    """Reads tilts at any place, from tables of presses at some places."""

    def __init__(self, tables: Sequence[PressTable], grid: FloatArray, noise: float) -> None:
        """Fit the tables.

        Args:
            tables: of the presses that are known, by the same grid.
            grid: (k, 2) degrees, its tilts.
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
        """(n, 3): the normals read, in the frame whose third axis is the untouched one."""
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
        """(n, 7): what the change of a channel may depend on."""
        x, y = (places / self._reach).T
        known = self._levels[:, channel]
        level = (levels - known.mean()) / (known.std() + LEAST_SPREAD)
        return np.stack([np.ones_like(x), x, y, level, x**2 - 0.5, y**2 - 0.5, x * y], axis=1)

    def _fit(
        self, change: FloatArray, within: FloatArray, channel: int
    ) -> tuple[FloatArray, FloatArray]:
        """(k, 7) coefficients at each tilt, and (k,) their variance, levels squared."""
        terms = self._terms(self._places, self._levels[:, channel], channel)
        weights = self._weights
        penalty = np.diag([1e-9, *[SLOPE_PENALTY] * 3, *[CURVE_PENALTY] * 3])
        inverse = np.linalg.inv(np.einsum("jk,ja,jb->kab", weights, terms, terms) + penalty)
        sums = np.einsum("jk,ja,jk->ka", weights, terms, change)
        coefficients = np.einsum("kab,kb->ka", inverse, sums)
        # The distance from the fit to the others alone follows from that to the whole fit.
        leverage = weights * np.einsum("ja,kab,jb->jk", terms, inverse, terms)
        distance = (change - terms @ coefficients.T) / (1.0 - np.minimum(leverage, MOST_LEVERAGE))
        variance = (weights * (distance**2 + within)).sum(axis=0) / weights.sum(axis=0)
        return coefficients, variance
