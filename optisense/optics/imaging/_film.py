"""The film: sums of the light of camera samples, with a layer for each light group."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from optisense.optics.backend.arrays import padded, tiled
from optisense.optics.scene.lamp_windows import LampWindows
from optisense.optics.transport.camera_paths import VisiblePoints

REFERENCE_WIDTH = 320
"""Image width (pixels) for which the numbers of samples per pixel are stated: the usual width of a
tactile picture."""


def repeated(mask: NDArray[np.bool_], times: int) -> tuple[mi.UInt32, mi.UInt32]:
    """Return the index of each pixel of a non-empty mask (h, w) ``times`` times, and the number of
    each sample in its pixel, from 1; (n,) each.
    """
    # The arrays are made on the device, as NumPy arrays differ in alignment, which is part of
    # kernels.
    chosen = dr.compress(mi.Bool(padded(mask.ravel())))
    lane = dr.arange(mi.UInt32, dr.width(chosen) * times)
    count = dr.opaque(mi.UInt32, dr.width(chosen))
    return tiled(chosen, times), lane // count + 1


class Film:
    """Sums of radiance and of samples per pixel and group."""

    def __init__(self, pixels: int, groups: int) -> None:
        self.groups = groups
        self.sums = dr.zeros(mi.Float, groups * pixels * 3)
        self.counts = dr.zeros(mi.Float, pixels)
        self._stride = dr.opaque(mi.UInt32, pixels * 3)

    def count(self, pixel: mi.UInt32) -> None:
        """Count one sample of each of these pixels (n,)."""
        dr.scatter_add(self.counts, mi.Float(1), pixel)

    def add(self, points: VisiblePoints, radiance: list[mi.Color3f]) -> None:
        """Add the radiance (3, n) of visible points towards the camera, one array per group."""
        for group, value in enumerate(radiance):
            self.scatter(points.weight * value, points.pixel, mi.UInt32(group), points.valid)

    def scatter(
        self, value: mi.Color3f, pixel: mi.UInt32, group: mi.UInt32, active: mi.Bool
    ) -> None:
        """Add values (3, n) to pixels (n,) of the layers of groups (n,) or (1,)."""
        first = group * self._stride + pixel * 3
        for k in range(3):
            dr.scatter_add(self.sums, value[k], first + k, active)

    def add_light(self, points: VisiblePoints, lamps: LampWindows) -> None:
        """Add the windows of lamps that are seen directly."""

        def add(value: mi.Float, group: mi.UInt32, seen: mi.Bool) -> None:
            self.scatter(points.weight * value, points.pixel, group, seen)

        lamps.add_radiances(points.light, points.towards_eye, add)

    def layers(self, width: int, height: int) -> NDArray[np.float32]:
        """Return the layers (groups, h, w, 3): the sums divided by the number of samples."""
        share = 1 / np.maximum(np.asarray(self.counts), 1).reshape(height, width, 1)
        sums = np.asarray(self.sums, dtype=np.float32)
        return np.asarray(sums.reshape(self.groups, height, width, 3) * share, dtype=np.float32)

    def averaged_layers(
        self,
        width: int,
        height: int,
        regions: list[tuple[NDArray[np.bool_], int]],
        deblurred: bool = False,
    ) -> NDArray[np.float32]:
        """Return the layers with the pixels of each region averaged over the samples of other
        pixels of the region around them.

        Args:
            width: number of pixels in a row.
            height: number of rows.
            regions: (h, w) mask of pixels that are averaged with one another, and half the side
                (pixels, odd) of the square over which a triangular kernel averages them.
            deblurred: whether most of the blur is undone by twicing: the kernel K is replaced by
                2 K - K K. The noise is then up to a quarter larger.
        """
        layers = self.layers(width, height)
        samples = np.asarray(self.counts).reshape(height, width)
        for where, reach in regions:
            if reach > 1:
                average_pixels(layers, samples, where, reach, deblurred)
        return layers


def box_around(where: NDArray[np.bool_], margin: int) -> tuple[slice, slice]:
    """Return the rows and columns of the box around a mask (h, w), which is not empty, with a
    margin (pixels) as far as the image extends.
    """
    rows, columns = (np.flatnonzero(where.any(axis=axis)) for axis in (1, 0))
    height, width = where.shape
    return (
        slice(max(0, int(rows[0]) - margin), min(height, int(rows[-1]) + margin + 1)),
        slice(max(0, int(columns[0]) - margin), min(width, int(columns[-1]) + margin + 1)),
    )


def averaged_twice(image: NDArray[np.floating], side: int) -> NDArray[np.floating]:
    """Return an image (h, w), 0 beyond its edges, averaged twice over a square (odd, pixels)."""
    for _ in range(2):
        image = ndimage.uniform_filter(image, side, mode="constant")
    return image


def average_pixels(
    layers: NDArray[np.float32],
    samples: NDArray[np.float32],
    where: NDArray[np.bool_],
    reach: int,
    deblurred: bool,
) -> None:
    """Average the pixels ``where`` of layers (groups, h, w, 3) as in `Film.averaged_layers`.

    ``samples`` is the number of samples of each pixel.
    """

    if not where.any():
        return
    part = box_around(where, reach // 2)
    where = where[part]

    counts = samples[part] * where
    near = averaged_twice(counts, reach)
    share = np.divide(1, near, out=np.zeros_like(near), where=where & (near > 0))
    for layer in layers:
        for k in range(3):
            values = layer[*part, k]
            if values.any():
                mean = averaged_twice(values * counts, reach) * share
                if deblurred:
                    again = averaged_twice(mean * counts, reach) * share
                    mean = np.maximum(2 * mean - again, 0)
                layer[*part, k] = np.where(where, mean, values)
