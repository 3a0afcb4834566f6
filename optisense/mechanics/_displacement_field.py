"""The displacement of a gel around one contact, interpolated between the points of its grids."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_erosion, distance_transform_edt, map_coordinates, maximum_filter

from optisense.array_types import FloatArray
from optisense.mechanics._convolution import GridResponse
from optisense.mechanics._elasticity import Elasticity
from optisense.mechanics._footprint import NO_OVERLAP, Footprint
from optisense.mechanics._grid_spline import GridArea, GridSpline, LimitedSpline, binned
from optisense.mechanics._height_map import slopes

if TYPE_CHECKING:
    from optisense.mechanics._gel_patch import GelPatch

Read = Callable[[FloatArray, FloatArray], FloatArray]
"""Function that returns values (..., n) of a grid at points (n,), mm."""

RING = 1.0
"""Width of the fine grid around a footprint, over the footprint's shorter side or, if that is less,
the gel's thickness; displacements vary slowly farther out."""
DECAY = 6.0
"""Distance from a footprint, in thicknesses, beyond which displacements are neglected. They are
less than 0.3 % there of those at half a thickness, for any Poisson ratio."""
BEND_REACH = 2
"""Distance, in pitches of a contact's grid, within which the largest second difference of
the slopes counts: about half of the longest triangle."""
COARSE_POINTS = 20
"""Number of points of the coarse grid per thickness of the gel; the grid resolves bulges, which are
as wide as the gel is thick."""
COARSE_STEP = 16
"""Step in which the number of points of the coarse grid along a side grows, so that contacts of
similar sizes share its kernels."""
MAX_COARSE = 400
"""Largest number of points of the coarse grid along a side, which bounds its transform's time."""


class DisplacementField:
    """Displacement around one contact, on a fine grid inside a coarse one.

    Between grid points it is a cubic spline, so that slopes are smooth. Beside sharp edges of an
    indenter, it does not overshoot.

    Attributes:
        place: the grid of the pressure.
        shear: (2, rows, columns) shear (MPa) of a dragged indenter, 0 at first; it must be set
            before `tangential` is called.
    """

    def __init__(
        self,
        place: Footprint,
        overlap: FloatArray,
        pressure: FloatArray,
        elasticity: Elasticity,
        beyond: GridSpline | None = None,
        patch: GelPatch | None = None,
    ) -> None:
        """Compute the displacement due to a pressure (rows, columns), MPa.

        Args:
            overlap: (rows, columns) overlap (mm) of the place, minus the displacement due to other
                contacts and minus ``beyond``.
            beyond: normal displacement of the gel in addition to that of a flat layer, by a patch.
        """
        self._beyond, self._patch = beyond, patch
        self._shear_modulus = elasticity.shear_modulus
        self.place, self._overlap = place, overlap
        pitch, thickness = place.pitch, place.thickness
        rows, columns = place.overlap.shape
        ring = int(np.ceil(RING * min(rows, columns, thickness / pitch)))
        shape = rows + 2 * ring, columns + 2 * ring
        # Only the middle of either grid is loaded.
        farthest = rows + ring - 1, columns + ring - 1
        response = grid_response(shape, pitch, thickness, elasticity, farthest)
        x0, y0 = place.x[0] - ring * pitch, place.y[0] - ring * pitch
        self._touching, self._pressure = pressure > 0.0, pressure
        step = thickness / COARSE_POINTS
        reach = DECAY * thickness
        ends = [(g[0] - reach, g[-1] + reach) for g in (place.x, place.y)]
        step = max(step, pitch, max(b - a for a, b in ends) / MAX_COARSE)
        needed = [int(np.ceil((b - a) / step)) + 1 for a, b in ends]
        counts = [COARSE_STEP * int(np.ceil(n / COARSE_STEP)) for n in needed]
        coarse = binned(pressure, place, (ends[0][0], ends[1][0]), step, (counts[1], counts[0]))
        border = int(reach / step) - 1  # squares in front of the first one that is loaded
        farthest = counts[1] - 1 - border, counts[0] - 1 - border
        wide = grid_response((counts[1], counts[0]), step, thickness, elasticity, farthest)
        # What follows from these is computed when it is asked for: other contacts need the coarse
        # grid only, and few calls need displacements along the skin.
        self.shear: FloatArray = np.zeros((2, rows, columns))
        self._ring = ring
        self._loads = (
            (response, np.pad(pressure, ring), (x0, y0, pitch)),
            (wide, coarse, (ends[0][0], ends[1][0], step)),
        )
        self._areas = [GridArea(response.shape, *start) for response, _, start in self._loads]

    def at(self, x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the displacement (n,), mm, into the gel at points (n,), mm, of the tangent plane,
        and its slopes (n,) by x and (n,) by y.

        The slope jumps at the edge of a contact; inside, it equals that of the indenter.
        """
        result = self._read(
            x, y, lambda *at: self._fine.at(*at), lambda *at: self._coarse.at_linear(*at), 3
        )
        inside = self.touching(x, y)
        if inside.any():
            column, row = (
                (values[inside] - start) / self.place.pitch
                for values, start in ((x, self.place.x[0]), (y, self.place.y[0]))
            )
            for k, slope in enumerate(self._indenter_slopes):
                result[1 + k, inside] = map_coordinates(slope, [row, column], order=1)
        if self._beyond is not None:
            known = self._beyond.holds(x, y)
            result[:, known] += self._beyond.at(x[known], y[known])
        return result[0], result[1], result[2]

    def depth(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Return the displacement (n,), mm, of points of the tangent plane into the gel."""
        (result,) = self._read(
            x, y, lambda *at: self._fine.value(*at), lambda *at: self._coarse.value(*at)
        )
        if self._beyond is not None:
            known = self._beyond.holds(x, y)
            result[known] += self._beyond.value(x[known], y[known])
        return result

    def normal(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Return the displacement (3, n), mm, outward of points of the tangent plane."""
        return np.stack([np.zeros(len(x)), np.zeros(len(x)), -self.depth(x, y)])

    def sheared(self, shear: FloatArray, x: FloatArray, y: FloatArray) -> FloatArray:
        """Return the displacement (3, n), mm, along x and y of points of the tangent plane by a
        shear (2, rows, columns), MPa, alone.
        """
        splines = self._splines_along(shear, with_pressure=False)
        beyond = self._tangential_beyond(shear, np.zeros_like(self._pressure))
        return np.concatenate([self._along(splines, beyond, x, y), np.zeros((1, len(x)))])

    def tangential(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Return the displacement (2, n), mm, of points of the tangent plane along x and y."""
        return self._along(*self._tangential_splines, x, y)

    def _along(
        self,
        splines_of_grids: list[tuple[GridSpline, GridSpline]],
        beyond: tuple[GridSpline, GridSpline] | None,
        x: FloatArray,
        y: FloatArray,
    ) -> FloatArray:
        """Return the displacement (2, n), mm, along x and y at points of the tangent plane, from
        splines on the fine and on the coarse grid and those of the effect of the gel's shape.
        """
        fine, coarse = splines_of_grids
        result = np.concatenate([self._read(x, y, fine[k].value, coarse[k].value) for k in (0, 1)])
        if beyond is not None:
            known = beyond[0].holds(x, y)
            result[:, known] += [spline.value(x[known], y[known]) for spline in beyond]
        return result

    def _read(
        self, x: FloatArray, y: FloatArray, fine: Read, coarse: Read, rows: int = 1
    ) -> FloatArray:
        """Return values (rows, n) at points (n,), mm: those of the fine grid where it reaches, and
        those of the coarse one, or 0, farther out.
        """
        result = np.zeros((rows, len(x)))
        near, reached = (area.holds(x, y) for area in self._areas)
        for where, read in ((near, fine), (reached & ~near, coarse)):
            if where.any():
                result[:, where] = read(x[where], y[where])
        return result

    @cached_property
    def _fine(self) -> LimitedSpline:
        response, pressure, start = self._loads[0]
        fine = response.normal(pressure)
        inside = tuple(slice(self._ring, self._ring + n) for n in self._touching.shape)
        fine[inside][self._touching] = self._overlap[self._touching]
        return LimitedSpline(fine, *start)

    @cached_property
    def _coarse(self) -> GridSpline:
        wide, coarse, start = self._loads[1]
        return GridSpline(wide.normal(coarse), *start)

    @cached_property
    def _tangential_splines(
        self,
    ) -> tuple[list[tuple[GridSpline, GridSpline]], tuple[GridSpline, GridSpline] | None]:
        splines = self._splines_along(self.shear, with_pressure=True)
        return splines, self._tangential_beyond(self.shear, self._pressure)

    def _tangential_beyond(
        self, shear: FloatArray, pressure: FloatArray
    ) -> tuple[GridSpline, GridSpline] | None:
        """Return the contribution of the gel's shape to displacements along x and y, if any."""
        if self._patch is None:
            return None
        loads = np.concatenate([shear, pressure[None]])
        return tangential_beyond(self._patch, loads, self.place, self._shear_modulus)

    def _splines_along(
        self, shear: FloatArray, with_pressure: bool
    ) -> list[tuple[GridSpline, GridSpline]]:
        """Return splines of the displacement along x and y on the fine and the coarse grid."""
        _, (wide, _, start) = self._loads
        ring = self._ring
        shears = (
            np.pad(shear, ((0, 0), (ring, ring), (ring, ring))),
            np.stack([binned(a, self.place, start[:2], start[2], wide.shape) for a in shear]),
        )
        found = []
        for (response, pressure, at), each in zip(self._loads, shears, strict=True):
            along_x, along_y = response.tangential(each, pressure if with_pressure else None)
            found.append((GridSpline(along_x, *at), GridSpline(along_y, *at)))
        return found

    def pressure(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Return the pressure (n,), MPa, at points of the tangent plane."""
        return self._between(self._pressure, x, y)

    def penetration(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Return the depth (n,), mm, of points of the undeformed skin in the indenter, or 0."""
        return self._between(np.maximum(self.place.overlap, 0.0), x, y)

    def _between(self, values: FloatArray, x: FloatArray, y: FloatArray) -> FloatArray:
        """Interpolate values of the contact's grid linearly; 0 beside the grid."""
        pitch = self.place.pitch
        column, row = (x - self.place.x[0]) / pitch, (y - self.place.y[0]) / pitch
        return np.asarray(map_coordinates(values, [row, column], order=1, mode="constant"))

    @cached_property
    def _indenter_slopes(self) -> tuple[FloatArray, FloatArray]:
        """Return the slopes of the overlap by x and by y, (rows, columns) each.

        Where an indenter ends in a steep wall, they are the slopes of the touching points beside
        it.
        """
        known = np.where(self.place.overlap > NO_OVERLAP / 2, self._overlap, np.nan)
        by_x, by_y = slopes(known, self.place.pitch)
        return np.nan_to_num(by_x), np.nan_to_num(by_y)

    @cached_property
    def _bends(self) -> FloatArray:
        """Return the bend of `nearby` on the contact's grid."""
        found = np.zeros(self._touching.shape)
        for slope in self._indenter_slopes:
            for axis in (0, 1):
                inner = [slice(1, -1) if k == axis else slice(None) for k in (0, 1)]
                bend = np.abs(np.diff(slope, 2, axis=axis))
                np.maximum(found[tuple(inner)], bend, out=found[tuple(inner)])
        whole = binary_erosion(self._touching, np.ones((3, 3)))  # slopes jump at the rim
        return np.asarray(maximum_filter(np.where(whole, found, 0.0), 2 * BEND_REACH + 1))

    def touching(self, x: FloatArray, y: FloatArray) -> NDArray[np.bool_]:
        """Return a mask (n,) of the points (n,), mm, of the tangent plane in the contact."""
        rows, columns, inside = self._cells(x, y)
        return inside & self._touching[rows, columns]

    def nearby(self, x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return three values (n,) for points (n,), mm, of the tangent plane: the distance (mm)
        from the contact, 0 inside it and accurate to about a pitch; the distance (mm) from its rim;
        and the greatest second difference of the indenter's slopes on the contact's grid within
        `BEND_REACH`, 0 beside the contact.
        """
        rows, columns, inside = self._cells(x, y)
        away = self._away[rows, columns]
        outside = ~inside
        beyond = np.hypot(
            x[outside] - self.place.x[columns[outside]], y[outside] - self.place.y[rows[outside]]
        )
        away[outside] += np.where(beyond > self.place.pitch, beyond, 0.0)
        rim = np.maximum(away, self._depth[rows, columns])
        return away, rim, self._bends[rows, columns]

    @cached_property
    def _depth(self) -> FloatArray:
        """Return the distance (rows, columns), mm, of points of the contact from its outside."""
        inside = distance_transform_edt(np.pad(self._touching, 1))[1:-1, 1:-1]
        return np.asarray(inside) * self.place.pitch

    @cached_property
    def _away(self) -> FloatArray:
        return np.asarray(distance_transform_edt(~self._touching)) * self.place.pitch

    def _cells(
        self, x: FloatArray, y: FloatArray
    ) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.bool_]]:
        """Return the nearest row and column of the pressure's grid, and which points are on it."""
        column = np.round((x - self.place.x[0]) / self.place.pitch).astype(np.int64)
        row = np.round((y - self.place.y[0]) / self.place.pitch).astype(np.int64)
        rows, columns = self._touching.shape
        inside = (row >= 0) & (row < rows) & (column >= 0) & (column < columns)
        return row.clip(0, rows - 1), column.clip(0, columns - 1), inside


@lru_cache(maxsize=48)
def grid_response(
    shape: tuple[int, int],
    pitch: float,
    thickness: float,
    elasticity: Elasticity,
    farthest: tuple[int, int] | None = None,
) -> GridResponse:
    """Return the response of a grid; equal arguments share one object, which keeps its kernels (16
    bytes per grid point).
    """
    return GridResponse(shape, pitch, thickness, elasticity, farthest)


def tangential_beyond(
    patch: GelPatch, loads: FloatArray, place: Footprint, shear_modulus: float
) -> tuple[GridSpline, GridSpline]:
    """Return splines of the contribution (mm) of a gel's shape to displacements along x and y by
    loads (3, rows, columns), MPa, along x and y and into the gel.
    """
    pitch, start = patch.columns.pitch, (patch.x[0], patch.y[0])
    coarse = np.stack([binned(a, place, start, pitch, patch.shape) for a in loads])
    along_x, along_y = patch.tangential(coarse * pitch**2 / shear_modulus)
    return GridSpline(along_x, *start, pitch), GridSpline(along_y, *start, pitch)
