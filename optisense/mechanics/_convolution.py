"""Displacements of a layer's surface on a regular grid, by fast Fourier transforms."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from optisense.array_types import FloatArray
from optisense.mechanics._elasticity import Elasticity
from optisense.mechanics._layer import LoadKernels, SquareLoad

ODD = {
    "xz": (True, False),
    "yz": (False, True),
    "xx": (False, False),
    "yy": (False, False),
    "xy": (True, True),
}
"""Symmetry of each kernel of `LoadKernels`: whether it is odd in x, and whether it is odd in y."""


class GridResponse:
    """The response of a bonded layer to loads that are uniform on each square of a grid.

    The grid is not periodic: transforms are padded so far that no square acts on another one from
    the other side.
    """

    def __init__(
        self,
        shape: tuple[int, int],
        pitch: float,
        thickness: float,
        elasticity: Elasticity,
        farthest: tuple[int, int] | None = None,
    ) -> None:
        """Set the grid, whose rows follow y and columns follow x; lengths in mm.

        ``farthest`` is the largest number of rows and of columns between a loaded square and any
        square of the grid; without it, all squares may be loaded.
        """
        self.shape, self.pitch = shape, pitch
        self._load = SquareLoad(
            pitch, thickness, elasticity.shear_modulus, elasticity.poisson_ratio
        )
        rows, columns = (
            max(size, 2 * (far + 1))  # an odd number of offsets, -far to far, and one more
            for size, far in zip(shape, farthest or (shape[0] - 1, shape[1] - 1), strict=True)
        )
        self._padded = fft.next_fast_len(rows), fft.next_fast_len(columns, real=True)

    def _quadrant(self) -> tuple[FloatArray, FloatArray]:
        """Return the non-negative offsets (mm) along x and y; kernels are even or odd in each."""
        rows, columns = (np.arange(size // 2 + 1) * self.pitch for size in self._padded)
        shape = len(rows), len(columns)
        return np.broadcast_to(columns, shape), np.broadcast_to(rows[:, None], shape)

    def _spectrum(
        self, quadrant: FloatArray, odd_in_x: bool = False, odd_in_y: bool = False
    ) -> NDArray[np.complex128]:
        """Return the Fourier transform of a kernel that is given for non-negative offsets."""
        offset = [fft.ifftshift(np.arange(size) - size // 2) for size in self._padded]
        whole = quadrant[np.ix_(np.abs(offset[0]), np.abs(offset[1]))]
        if odd_in_x:
            whole *= np.sign(offset[1])
        if odd_in_y:
            whole *= np.sign(offset[0])[:, None]
        return np.asarray(fft.rfft2(whole))

    @cached_property
    def _pressure_kernel(self) -> NDArray[np.complex128]:
        return self._spectrum(self._load.pressed_in(*self._quadrant()))

    @cached_property
    def _kernels(self) -> LoadKernels:
        quadrant = self._load.kernels(*self._quadrant())._asdict()
        spectra: list[Any] = [self._spectrum(quadrant[name], *odd) for name, odd in ODD.items()]
        return LoadKernels(*spectra)

    def normal(self, pressure: FloatArray) -> FloatArray:
        """Return the normal displacement (rows, columns), mm, into the layer, due to a pressure
        (rows, columns), MPa, on each square.
        """
        return self._restored(self._pressure_kernel * self._transformed(pressure))

    def tangential(self, shear: FloatArray, pressure: FloatArray | None = None) -> FloatArray:
        """Return the displacement (2, rows, columns), mm, along the surface by a shear (2, rows,
        columns) and a pressure (rows, columns), MPa, if there is one.
        """
        kernels = self._kernels
        along_x, along_y = self._transformed(shear[0]), self._transformed(shear[1])
        x = kernels.xx * along_x + kernels.xy * along_y
        y = kernels.xy * along_x + kernels.yy * along_y
        if pressure is not None:
            p = self._transformed(pressure)
            x, y = x + kernels.xz * p, y + kernels.yz * p
        return np.stack([self._restored(x), self._restored(y)])

    def largest_tangential(self) -> float:
        """Return the largest ratio (mm/MPa) of the RMS displacement along the surface to the RMS of
        the shear that causes it.
        """
        kernels = self._kernels
        crossed = np.abs(kernels.xy)
        return float(max((np.abs(each) + crossed).max() for each in (kernels.xx, kernels.yy)))

    def _transformed(self, load: FloatArray) -> NDArray[np.complex128]:
        return np.asarray(fft.rfft2(load, self._padded))

    def _restored(self, spectrum: NDArray[np.complex128]) -> FloatArray:
        rows, columns = self.shape
        return np.asarray(fft.irfft2(spectrum, self._padded)[:rows, :columns])
