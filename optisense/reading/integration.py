"""Depth from surface normals: a Poisson equation, solved by least squares."""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.ndimage import binary_erosion, median
from scipy.sparse.linalg import factorized

from optisense.array_types import FloatArray
from optisense.errors import TaskError
from optisense.reading.tilts import STEEPEST
from optisense.reading.untouched import UntouchedSurface

__all__ = ["GridIntegrator", "NormalIntegrator", "UntouchedSurface"]

ROUNDS = 3
"""Number of rounds of `NormalIntegrator.depths`: the change of a ray's direction between pixels,
times the depth, is a correction of some per cent, and each round makes its error that much
smaller."""


class GridIntegrator:
    """Integrator of slopes on the pixels of a mask.

    It minimises the squared difference between the values' steps from pixel to pixel and the mean
    of the slopes at both ends, which is exact for quadratic surfaces. The values of a connected
    part are determined up to a constant; their mean is set to 0.
    """

    def __init__(self, mask: NDArray[np.bool_]) -> None:
        """Prepare the equations for the pixels (h, w) that belong to the surface."""
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
        # One pixel of each part is fixed, so that the matrix is invertible.
        _, held = np.unique(self._part, return_index=True)
        pins = np.zeros(self._steps.shape[1])
        pins[held] = 1.0
        return factorized((self._steps.T @ self._steps + sparse.diags(pins)).tocsc())

    def from_steps(self, across: FloatArray, down: FloatArray) -> FloatArray:
        """Return values (h, w) from their steps to the next pixel, (h, w - 1) along rows and (h -
        1, w) along columns; NaN outside the mask.

        Steps to or from pixels outside the mask are ignored.
        """
        wanted = np.concatenate([across[self._across], down[self._down]])
        values = self._solve(self._steps.T @ wanted)  # type: ignore[operator]
        size = np.bincount(self._part, minlength=self._parts)
        mean = np.bincount(self._part, values, self._parts) / np.maximum(size, 1)
        result = np.full(self.mask.shape, np.nan)
        result[self.mask] = values - mean[self._part]
        return result

    @cached_property
    def _border(self) -> NDArray[np.bool_]:
        """Mask (n,) of the mask's pixels that have a neighbour outside; each part has some."""
        border: NDArray[np.bool_] = ~binary_erosion(self.mask)[self.mask]
        return border

    def level(self, values: FloatArray) -> FloatArray:
        """Return values (h, w) with the median along the border of each connected part set to 0;
        NaN outside the mask.
        """
        inside = values[self.mask]
        zero = median(inside[self._border], self._part[self._border], np.arange(self._parts))
        result = np.full(self.mask.shape, np.nan)
        result[self.mask] = inside - zero[self._part]
        return result


class NormalIntegrator:
    """Integrator of the normals that a camera sees to depth, on flat and on curved sensors.

    The integrated quantity is not a height over a plane but t, the distance of the surface back
    along each pixel's own ray (in the gel, a straight line): the surface is p(t) = p0 - t d, where
    p0 is the untouched point and d the ray's direction. The step from one pixel to the next lies in
    the surface, so it is perpendicular to its normal n. With t and d in the middle of both pixels,
    and D for differences between the two pixels,

        D t = (D p0 - t D d) . n / (d . n),

    averaged over the normals of both pixels, which is exact for quadratic surfaces. Perspective,
    refraction and curvature are contained in p0 and d, the results of chief rays; t on the right
    side is that of the previous round, and 0 in the first. Steps connect only neighbours that are
    both seen, so that no values beyond the border of the view are used.
    """

    def __init__(self, untouched: UntouchedSurface) -> None:
        """Prepare the integration for a sensor's surface and rays at the image's resolution:
        ``UntouchedSurface.of(model.chief_rays((w, h)))``.
        """
        self._untouched = untouched
        self._grid = GridIntegrator(untouched.seen)

    def depths(self, normals: NDArray[np.floating]) -> FloatArray:
        """Return the depth (h, w), mm, along the inward normal, from unit inward normals (h, w, 3).

        The integration constant is set so that the median along the border of the view is 0, as a
        contact should leave most of the border untouched. Each connected part of the view has a
        constant of its own.

        Raises:
            TaskError: there is not one normal for each pixel, or one of a seen pixel is not finite.
        """
        untouched = self._untouched
        normal = np.asarray(normals, dtype=np.float64)
        if normal.shape != untouched.points.shape:
            raise TaskError(
                f"normals of shape {normal.shape} do not fit the rays of {untouched.points.shape}",
                hint="Give the normals of a picture at the resolution of the rays",
            )
        if not np.isfinite(normal[untouched.seen]).all():
            raise TaskError(
                "normals of pixels that see the sensing surface are not finite",
                hint="Give these pixels the untouched normal, or leave them out of the seen ones",
            )
        steps = [_Steps.between(untouched, normal, axis) for axis in (1, 0)]
        back = np.zeros(untouched.seen.shape)
        for _ in range(ROUNDS):
            across, down = (each.of(back) for each in steps)
            back = self._grid.from_steps(across, down)
            back = np.nan_to_num(self._grid.level(back))
        surface = untouched.points - back[..., None] * untouched.directions
        surface[~untouched.seen] = np.nan
        return untouched.depth(surface)


class _Steps(NamedTuple):
    """The steps of t from each pixel to the next along an axis.

    Attributes:
        axis: 0 along columns, 1 along rows.
        rise: step (mm) for t = 0.
        turn: additional step due to the change of the ray's direction, per mm of t.
    """

    axis: int
    rise: FloatArray
    turn: FloatArray

    @staticmethod
    def between(untouched: UntouchedSurface, normal: FloatArray, axis: int) -> _Steps:
        """Return the steps along an axis for a surface with unit normals (h, w, 3)."""
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
        """Return the steps (mm) for a surface whose t is about `back` (h, w), mm."""
        return self.rise - _middle(back, self.axis) * self.turn


def _middle(values: FloatArray, axis: int) -> FloatArray:
    """Return the means of neighbours along an axis."""
    before, after = _neighbours(values, axis)
    return 0.5 * (before + after)


def _neighbours(values: FloatArray, axis: int) -> tuple[FloatArray, FloatArray]:
    """Return the values before and after each step along an axis."""
    return (values[:, :-1], values[:, 1:]) if axis else (values[:-1], values[1:])
