"""Depth from surface normals: a Poisson equation, solved by least squares."""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import factorized

from optisense.reading.tilts import STEEPEST
from optisense.reading.untouched import UntouchedSurface

FloatArray = NDArray[np.float64]

ROUNDS = 3
"""Number of rounds of `NormalIntegrator.depths`: the change of a ray's direction between pixels,
times the depth, is a correction of some per cent, and each round makes its error that much
smaller."""


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

    def from_steps(self, across: FloatArray, down: FloatArray) -> FloatArray:
        """Values (h, w) from their steps to the next pixel: (h, w - 1) along rows, and (h - 1, w)
        along columns; NaN off the mask.

        Steps to or from pixels off the mask are not read.
        """
        wanted = np.concatenate([across[self._across], down[self._down]])
        values = self._solve(self._steps.T @ wanted)  # type: ignore[operator]
        size = np.bincount(self._part, minlength=self._parts)
        mean = np.bincount(self._part, values, self._parts) / np.maximum(size, 1)
        result = np.full(self.mask.shape, np.nan)
        result[self.mask] = values - mean[self._part]
        return result


class NormalIntegrator:
    """Depth from the normals that a camera sees, on flat and on curved sensors alike.

    What is integrated is not a height over a plane but t, how far back along its own ray (in the
    gel, a straight line) each pixel's surface lies: the surface is p(t) = p0 - t d, where p0 is the
    untouched point and d the ray's direction. From one pixel to the next, the step between the two
    lies in the surface, so it is square to its normal n. With t and d in the middle of both pixels,
    and D for what changes from one to the other,

        D t = (D p0 - t D d) . n / (d . n),

    as the mean of what the normals of both pixels give, which is exact for quadratic surfaces.
    Perspective, refraction and curvature are all in p0 and d, which chief rays give; t on the right
    is taken from the round before, first 0. Only neighbours that are both seen make a step, so that
    nothing is read beyond the border of the view.
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
        steps = [_Steps.between(untouched, normal, axis) for axis in (1, 0)]
        back = np.zeros(untouched.seen.shape)
        for _ in range(ROUNDS):
            across, down = (each.of(back) for each in steps)
            back = self._grid.from_steps(across, down)
            back = np.nan_to_num(back - np.median(back[_border(untouched.seen)]))
        surface = untouched.points - back[..., None] * untouched.directions
        surface[~untouched.seen] = np.nan
        return untouched.depth(surface)


class _Steps(NamedTuple):
    """How far back along its ray the surface goes from each pixel to the next along an axis.

    Attributes:
        axis: 0 along columns, 1 along rows.
        rise: mm, of a surface that is not moved.
        turn: what the change of the ray's direction adds to it, for each mm back.
    """

    axis: int
    rise: FloatArray
    turn: FloatArray

    @staticmethod
    def between(untouched: UntouchedSurface, normal: FloatArray, axis: int) -> _Steps:
        """The steps along an axis of a surface with these unit normals (h, w, 3)."""
        ways = _middle(untouched.directions, axis)
        changes = [np.diff(each, axis=axis) for each in (untouched.points, untouched.directions)]
        found = []
        for here in _neighbours(normal, axis):
            facing = np.einsum("...i,...i", ways, here)
            facing = np.minimum(facing, -np.cos(np.radians(STEEPEST)))
            found.append([np.einsum("...i,...i", each, here) / facing for each in changes])
        rise, turn = (0.5 * (one + other) for one, other in zip(*found, strict=True))
        return _Steps(axis, rise, turn)

    def of(self, back: FloatArray) -> FloatArray:
        """mm, where the surface is about `back` (h, w) mm back."""
        return self.rise - _middle(back, self.axis) * self.turn


def _middle(values: FloatArray, axis: int) -> FloatArray:
    """The means of neighbours along an axis."""
    before, after = _neighbours(values, axis)
    return 0.5 * (before + after)


def _neighbours(values: FloatArray, axis: int) -> tuple[FloatArray, FloatArray]:
    """The values before and after each step along an axis."""
    return (values[:, :-1], values[:, 1:]) if axis else (values[:-1], values[1:])


def _border(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """The pixels of a mask that touch what is not in it, or the image's edge."""
    padded = np.pad(mask, 1)
    whole = padded[:-2, 1:-1] & padded[2:, 1:-1] & padded[1:-1, :-2] & padded[1:-1, 2:]
    return mask & ~whole
