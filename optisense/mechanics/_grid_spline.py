"""Values on regular grids: cubic splines through them, and sums on coarser grids."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates, spline_filter

from optisense.array_types import FloatArray
from optisense.mechanics._footprint import Footprint


class GridArea:
    """The area of a regular grid."""

    def __init__(self, shape: tuple[int, ...], x0: float, y0: float, pitch: float) -> None:
        """Set the number of rows and columns of points from (x0, y0) on, and their pitch (mm)."""
        self._start, self._pitch, self._shape = (x0, y0), pitch, shape

    def holds(self, x: FloatArray, y: FloatArray) -> NDArray[np.bool_]:
        """Return a mask (n,) of points (n,), mm, one grid point or more inside the grid's rim."""
        column, row = self._place(x, y)
        rows, columns = self._shape
        return (column >= 1) & (column <= columns - 2) & (row >= 1) & (row <= rows - 2)

    def _place(self, x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
        return (x - self._start[0]) / self._pitch, (y - self._start[1]) / self._pitch


class GridSpline(GridArea):
    """A cubic spline through values on a regular grid."""

    def __init__(self, values: FloatArray, x0: float, y0: float, pitch: float) -> None:
        """Fit the spline to values (rows, columns) at points from (x0, y0), with a pitch (mm)."""
        super().__init__(values.shape, x0, y0, pitch)
        self._values = values
        self._coefficients = spline_filter(values, order=3, mode="mirror")

    def value(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Return the value (n,) at points (n,), mm."""
        column, row = self._place(x, y)
        return self._between(row, column)

    def at(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Return the value and its slopes by x and y over one pitch, (3, n), at points (n,), mm."""
        column, row = self._place(x, y)
        half = 0.5
        rows = np.concatenate([row, row, row, row - half, row + half])
        columns = np.concatenate([column, column - half, column + half, column, column])
        values = self._between(rows, columns).reshape(5, -1)
        return np.stack(
            [
                values[0],
                (values[2] - values[1]) / self._pitch,
                (values[4] - values[3]) / self._pitch,
            ]
        )

    def at_linear(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Return the values (3, n) of `at` with slopes that are linear between grid points, which
        takes a third of the time.
        """
        column, row = self._place(x, y)
        by_y, by_x = self._slopes
        return np.stack(
            [
                self._between(row, column),
                map_coordinates(by_x, [row, column], order=1),
                map_coordinates(by_y, [row, column], order=1),
            ]
        )

    @cached_property
    def _slopes(self) -> tuple[FloatArray, FloatArray]:
        """Return the slopes (rows, columns) by y and by x at the grid points."""
        by_y, by_x = np.gradient(self._values, self._pitch)
        return np.asarray(by_y), np.asarray(by_x)

    def _between(self, rows: FloatArray, columns: FloatArray) -> FloatArray:
        return np.asarray(
            map_coordinates(
                self._coefficients, [rows, columns], order=3, mode="mirror", prefilter=False
            )
        )


class LimitedSpline(GridSpline):
    """A cubic spline that does not overshoot beside steps.

    In each cell it stays between the values at the four corners, with an allowance for smooth tops
    and valleys, which lie between grid points.
    """

    def __init__(self, values: FloatArray, x0: float, y0: float, pitch: float) -> None:
        """Fit the spline; the arguments are those of `GridSpline`."""
        super().__init__(values, x0, y0, pitch)
        corners = _corners(values)
        self._low, self._high = corners.min(axis=0), corners.max(axis=0)
        for axis in (0, 1):
            bend = np.zeros_like(values)
            inner = bend[1:-1] if axis == 0 else bend[:, 1:-1]
            inner[:] = np.diff(values, 2, axis=axis)
            bends = _corners(bend)
            # A parabola of second difference b deviates by b / 8 from its chord. At a step, bends
            # differ between the corners of a cell, and the smallest one is near 0.
            self._high -= np.minimum(bends.max(axis=0), 0.0) / 8.0
            self._low -= np.maximum(bends.min(axis=0), 0.0) / 8.0

    def _between(self, rows: FloatArray, columns: FloatArray) -> FloatArray:
        last = self._low.shape[0] - 1, self._low.shape[1] - 1
        row = rows.astype(np.int64).clip(0, last[0])
        column = columns.astype(np.int64).clip(0, last[1])
        return np.clip(
            super()._between(rows, columns), self._low[row, column], self._high[row, column]
        )


def _corners(values: FloatArray) -> FloatArray:
    """Return the values (4, rows - 1, columns - 1) at the corners of each cell of a grid."""
    return np.stack([values[:-1, :-1], values[1:, :-1], values[:-1, 1:], values[1:, 1:]])


def binned(
    pressure: FloatArray,
    place: Footprint,
    start: tuple[float, float],
    step: float,
    shape: tuple[int, int],
) -> FloatArray:
    """Return a pressure (rows, columns), MPa, on a coarser grid of some shape with the same force
    and centre, distributed linearly.

    The first point of the coarser grid is at ``start`` (x and y), and its pitch is ``step``, mm.
    """
    column = (place.x - start[0]) / step
    row = (place.y - start[1]) / step
    result = np.zeros(shape)
    share = (place.pitch / step) ** 2
    for up in (0, 1):
        for right in (0, 1):
            rows = np.floor(row).astype(np.int64) + up
            columns = np.floor(column).astype(np.int64) + right
            weight_y = np.abs(1 - up - (row - np.floor(row)))
            weight_x = np.abs(1 - right - (column - np.floor(column)))
            weights = weight_y[:, None] * weight_x[None, :]
            np.add.at(result, np.ix_(rows, columns), share * weights * pressure)
    return result
