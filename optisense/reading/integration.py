"""Depth from surface normals: a Poisson equation, solved by least squares."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import factorized

from optisense.reading.tilts import STEEPEST
from optisense.reading.untouched import UntouchedSurface

FloatArray = NDArray[np.float64]

ROUNDS = 3
"""Of `NormalIntegrator.depths`: the change of a ray's direction between pixels, times the depth,
is a correction of some per cent, and each round makes its error that much smaller."""


class GridIntegrator:
    """Finds values on the pixels of a mask from their slopes.

    Minimises the squared difference between the values' steps from pixel to pixel and the mean
    of the slopes at both ends, which is exact for quadratic surfaces. Whatever is connected is
    known up to a constant; each connected part gets the mean 0.
    """

    def __init__(self, mask: NDArray[np.bool_]) -> None:
        """Args: mask: (h, w), the pixels that belong to the surface."""
        self.mask = mask
        number = np.full(mask.shape, -1)
        number[mask] = np.arange(mask.sum())
        across = mask[:, :-1] & mask[:, 1:]
        down = mask[:-1] & mask[1:]
        self._across, self._down = across, down
        tails = np.concatenate([number[:, :-1][across], number[:-1][down]])
        heads = np.concatenate([number[:, 1:][across], number[1:][down]])
        steps = np.arange(len(tails))
        ones = np.ones(len(tails))
        self._steps = sparse.csr_matrix(
            (
                np.concatenate([-ones, ones]),
                (np.concatenate([steps, steps]), np.concatenate([tails, heads])),
            ),
            shape=(len(tails), int(mask.sum())),
        )
        self._parts, self._part = sparse.csgraph.connected_components(
            self._steps.T @ self._steps, directed=False
        )

    @cached_property
    def _solve(self) -> object:
        # One pixel of each part is held, so that the matrix has an inverse.
        _, held = np.unique(self._part, return_index=True)
        pins = np.zeros(self._steps.shape[1])
        pins[held] = 1.0
        return factorized((self._steps.T @ self._steps + sparse.diags(pins)).tocsc())

    def integrate(self, slope_x: FloatArray, slope_y: FloatArray) -> FloatArray:
        """Values (h, w) from slopes (h, w) a pixel, along columns and along rows; NaN off the mask.

        Slopes off the mask are not read.
        """
        x = 0.5 * (slope_x[:, :-1] + slope_x[:, 1:])[self._across]
        y = 0.5 * (slope_y[:-1] + slope_y[1:])[self._down]
        values = self._solve(self._steps.T @ np.concatenate([x, y]))  # type: ignore[operator]
        size = np.bincount(self._part, minlength=self._parts)
        mean = np.bincount(self._part, values, self._parts) / np.maximum(size, 1)
        result = np.full(self.mask.shape, np.nan)
        result[self.mask] = values - mean[self._part]
        return result


class NormalIntegrator:
    """Depth from the normals that a camera sees, on flat and on curved sensors alike.

    What is integrated is not a height over a plane but t, how far back along its own ray (in the
    gel, a straight line) each pixel's surface lies: the surface is p(t) = p0 - t d, where p0 is
    the untouched point and d the ray's direction. Going one pixel on, p must stay in the surface
    whose normal is n, so p' . n = 0, and with p' = p0' - t' d - t d'

        t' = (p0' - t d') . n / (d . n).

    Perspective, refraction and curvature are all in p0 and d, which chief rays give; t on the
    right is taken from the round before, first 0.
    """

    def __init__(self, untouched: UntouchedSurface) -> None:
        """Args: untouched: the sensor's surface and rays at the image's resolution."""
        self._untouched = untouched
        self._grid = GridIntegrator(untouched.seen)

    def depths(self, normals: NDArray[np.floating]) -> FloatArray:
        """(h, w) mm along the inward normal, from unit inward normals (h, w, 3).

        The constant that integration leaves open is set so that the median along the border of
        what is seen is 0: a contact should leave most of the border untouched.
        """
        untouched = self._untouched
        normal = np.asarray(normals, dtype=np.float64)
        facing = np.einsum("...i,...i", untouched.directions, normal)
        facing = np.minimum(facing, -np.cos(np.radians(STEEPEST)))
        points = _pixel_steps(untouched.points)
        turns = _pixel_steps(untouched.directions)
        back = np.zeros(untouched.seen.shape)
        for _ in range(ROUNDS):
            x, y = (
                np.einsum("...i,...i", point - back[..., None] * turn, normal) / facing
                for point, turn in zip(points, turns, strict=True)
            )
            back = self._grid.integrate(x, y)
            back = np.nan_to_num(back - np.median(back[_border(untouched.seen)]))
        surface = untouched.points - back[..., None] * untouched.directions
        surface[~untouched.seen] = np.nan
        return untouched.depth(surface)


def _pixel_steps(values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Derivatives of (h, w, 3) values a pixel, along columns and along rows."""
    return np.gradient(values, axis=1), np.gradient(values, axis=0)


def _border(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """The pixels of a mask that touch what is not in it, or the image's edge."""
    padded = np.pad(mask, 1)
    whole = padded[:-2, 1:-1] & padded[2:, 1:-1] & padded[1:-1, :-2] & padded[1:-1, 2:]
    return mask & ~whole
