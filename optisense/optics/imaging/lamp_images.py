"""Light of lamps that interfaces send to the camera: mirror images, and glare of rough faces."""

from __future__ import annotations

from dataclasses import replace

import drjit as dr
import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from optisense.optics.backend.sequences import seed_of
from optisense.optics.camera.projection import RayCamera
from optisense.optics.imaging._film import (
    Film,
    average_pixels,
    averaged_twice,
    box_around,
    repeated,
)
from optisense.optics.scene.lamp_windows import LampWindows
from optisense.optics.scene.ray_scene import RayScene
from optisense.optics.transport.camera_paths import film_samples, find_visible_points

SEARCH_WIDTH = 160
"""Width (pixels) of the image in which mirror images of lamps are looked for."""
LAMP_PATHS = 8
"""Number of paths through each pixel of an image of this width that look for lamps; finer images
have fewer, in inverse proportion to their width. They are traced once for all images of a sensor,
in 0.02 s for 160x120 pixels of GelSight Mini."""
GLINT_PATHS = 64
"""Number of further paths through the pixels around a lone bright pixel, of which there are few."""
STEADY_SHARE = 1 / 8
"""Share of these paths that meet a lamp, from which on its mirror image keeps its place. Around a
contact of GelSight360 with a perspective camera, where interfaces mirror the ring of blue lamps, 22
of 25 lone pixels have this share. One path in a thousand causes a speck."""

GLARE_BATCHES = 4
"""Number of batches of such paths that sample glare; the noise is known from their differences. For
an image of 320x240 pixels, these are 16 paths through each pixel, traced once for all images of a
sensor."""
GLARE_NOISE = 0.03
"""Noise of glare, relative to it, below which it is not averaged: three times a camera's own noise,
which is about 0.01."""
GLARE_EDGE = 4.0
"""Difference between the averages with two kernels, in standard errors, above which glare counts as
sharp and has the narrower one, if as many of these errors are less than the glare. Where a face of
roughness 0.01 shows the outline of a lamp, the mean error of pixels is then 6 instead of 9 %."""
GLARE_WIDTHS = 1 / 16, 1 / 32, 1 / 64, 1 / 128, 0.0
"""Half widths of the kernels that average glare, as fractions of the image width. Each pixel has
the narrowest with which its noise is low. The widest leaves a noise of 3 % of the glare that a wide
lamp causes on a face of roughness 0.3, at 320x240 pixels."""

LONE_WINDOW, LONE_RANK = 5, 4
"""Side (pixels) of the square around a bright pixel, and the number of its pixels, itself included,
that must be bright for the pixel not to count as lone."""
LONE_RATIO = 2.0
"""Ratio of a pixel's light to that of the `LONE_RANK`-th brightest pixel in its square above which
the excess light is spread over the pixels around it. A factor of two is more than the noise between
neighbouring pixels of a real reflection."""
SPECK_WIDTH = 1.0 / 8.0
"""Width over which that excess is spread, as a fraction of the image width; a speck of 50 times the
light around it then adds 3 % to its middle."""
BALANCING_STEPS = 5
"""Number of steps in which the kernel of the spreading is balanced within a region (Sinkhorn and
Knopp 1967). Even light in a square twice as wide as the kernel then varies by 1.3 %."""


class LampImages:
    """The mirror images of the lamps of a sensor, and their glare on rough faces.

    Interfaces send this light to the camera before it reaches the skin, so that it does not depend
    on contacts. The image that was made last is kept: images with and without contacts, which are
    subtracted from each other, then have the same mirror images. Lamps are so bright that a rare
    path (one in a thousand) that meets one causes a speck. The light of specks is spread over the
    pixels around them. Glare, which rough faces scatter, is smooth, and is averaged over the pixels
    around each where few paths meet a lamp.
    """

    def __init__(self, scene: RayScene, windows: LampWindows, groups: int) -> None:
        """Prepare the mirror images.

        Args:
            groups: number of light groups.
        """
        self._scene, self._windows, self._groups = scene, windows, groups
        self._kept: tuple[tuple[int, int, int], NDArray[np.float32]] | None = None
        self._found: tuple[bool, bool] | None = None  # whether there are mirror images, glare

    def layers(self, camera: RayCamera, seed: int) -> NDArray[np.float32] | None:
        """Return the layers (groups, h, w, 3) of the image of a camera; None if there is no such
        light.

        The camera may differ from that of the call before only in its resolution.
        """
        if self._found is None:
            height = max(1, round(SEARCH_WIDTH * camera.height / camera.width))
            small = replace(camera, width=SEARCH_WIDTH, height=height)

            def meet(glare: bool) -> bool:
                return bool(self._traced(small, 0, glare)[0].any())

            exist = self._windows.exist
            self._found = exist and meet(False), exist and self._scene.rough and meet(True)
        if not any(self._found):
            return None
        key = camera.width, camera.height, seed
        if self._kept is None or self._kept[0] != key:
            mirrored, glare = self._found
            layers = np.zeros((self._groups, camera.height, camera.width, 3), dtype=np.float32)
            if mirrored:
                layers += self._mirrored(camera, seed)
            if glare:
                layers += self._glare(camera, seed)
            self._kept = key, layers
        return self._kept[1]

    def _mirrored(self, camera: RayCamera, seed: int) -> NDArray[np.float32]:
        """Return the layers of mirror images."""
        layers, _ = self._traced(camera, seed_of(seed, 11))
        lone = np.zeros(layers.shape[1:3], dtype=bool)
        for layer in layers:
            bright = layer.sum(axis=-1)
            lone |= _left_of_lone(bright) < bright
        if not lone.any():
            return layers
        beside = np.ones((3, 3), dtype=bool)
        around = ndimage.binary_dilation(lone, beside)
        again, meetings = self._traced(camera, seed_of(seed, 12), around=around)
        steady = around & (meetings >= STEADY_SHARE * GLINT_PATHS)
        steady = ndimage.binary_dilation(steady, beside, mask=around)
        return without_specks(np.where(steady[..., None], again, layers), steady)

    def _glare(self, camera: RayCamera, seed: int) -> NDArray[np.float32]:
        """Return the layers of glare, by some batches of paths."""
        frosted = np.zeros((camera.height, camera.width), dtype=bool)
        mean = np.zeros((self._groups, *frosted.shape, 3), dtype=np.float32)
        square = np.zeros_like(mean)
        for number in range(GLARE_BATCHES):
            batch, rough = self._traced(camera, seed_of(seed, 14, number), glare=True)
            mean += batch / GLARE_BATCHES
            square += batch**2 / GLARE_BATCHES
            frosted |= rough > 0
        variance = np.maximum(square - mean**2, 0) / (GLARE_BATCHES - 1)
        return _steadied(mean, variance, frosted)

    def _traced(
        self,
        camera: RayCamera,
        seed: int,
        glare: bool = False,
        around: NDArray[np.bool_] | None = None,
    ) -> tuple[NDArray[np.float32], NDArray[np.floating]]:
        """Return the lamps' layers (groups, h, w, 3), by `LAMP_PATHS` through all pixels or by
        `GLINT_PATHS` through those of a mask, and the number (h, w) of paths that meet a lamp; with
        ``glare`` of those that meet a rough face, also if they meet no lamp.
        """
        pixels, paths = around, GLINT_PATHS
        if pixels is None:
            pixels = np.ones((camera.height, camera.width), dtype=bool)
            paths = max(1, round(LAMP_PATHS * SEARCH_WIDTH / camera.width))
        pixel, number = repeated(pixels, paths)
        dr.eval(pixel, number)
        spots = film_samples(pixel, camera.width, number, seed)
        film = Film(pixels.size, self._groups)
        film.count(pixel)
        count = np.zeros(pixels.size)
        channels = self._scene.channels
        for channel in channels:
            main, reflected = find_visible_points(
                self._scene, camera, pixel, number, spots, seed_of(seed, 1), channel=channel
            )
            for points in (main, reflected) if glare else (reflected,):
                if points is None:
                    continue
                points.light = dr.select(points.scattered == glare, points.light, 0)
                film.add_light(points, self._windows)
                counted = points.scattered if glare else points.light > 0
                count += np.bincount(np.asarray(points.pixel), np.asarray(counted), pixels.size)
        layers = film.layers(camera.width, camera.height)
        return layers, count.reshape(pixels.shape) / len(channels)


def _steadied(
    layers: NDArray[np.float32], variance: NDArray[np.float32], region: NDArray[np.bool_]
) -> NDArray[np.float32]:
    """Return layers (groups, h, w, 3), each pixel of a region (h, w) of which is averaged over as
    many others of the region around it as its noise requires. The sum of a group does not change.
    """
    # The noise with a kernel is known from the averages with the next wider one: if it were known
    # from its own, pixels that are too bright by chance would be averaged less.
    samples = region.astype(np.float32)
    reaches = [round(width * layers.shape[2]) | 1 for width in GLARE_WIDTHS]
    found, steady = layers, np.broadcast_to(region, layers.shape[:3])
    kernel = np.zeros(steady.shape, dtype=np.uint8)
    wider, square = layers, np.zeros_like(layers)
    for number, reach in enumerate(reaches):
        mean, spread = layers.copy(), variance.copy()
        if reach > 1:
            average_pixels(mean, samples, region, reach, deblurred=True)
            average_pixels(spread, samples, region, reach, deblurred=False)
        # The inverse of the sum of the squares of the kernel, which is triangular each way.
        pixels = (3 * reach**3 / (2 * reach**2 + 1)) ** 2
        error = np.sqrt(square / pixels).sum(axis=-1)
        bright = wider.sum(axis=-1)
        apart = np.abs(mean.sum(axis=-1) - bright) > GLARE_EDGE * error
        steady = steady & ((error <= GLARE_NOISE * bright) | apart & (error <= bright / GLARE_EDGE))
        found = np.where(steady[..., None], mean, found)
        kernel[steady] = number
        wider, square = mean, spread

    # A pixel with a wide kernel beside a sharp spot takes light that the spot keeps, too. Where
    # kernels differ, what a pixel has too much is taken from those over which it was averaged.
    lost = layers - found
    for number, reach in enumerate(reaches):
        near = averaged_twice(samples, reach)
        share = np.divide(1, near, out=np.zeros_like(near), where=region)
        for layer, back, chosen in zip(found, lost, kernel == number, strict=True):
            beside = chosen & ndimage.maximum_filter(region & ~chosen, 2 * reach - 1)
            for k in range(3):
                layer[..., k] += averaged_twice(back[..., k] * beside * share, reach) * samples
    np.maximum(found, 0, out=found)  # adds light, which the factor below removes
    total, kept = (each.sum(axis=(1, 2, 3), keepdims=True) for each in (layers, found))
    return found * np.divide(total, kept, out=np.ones_like(kept), where=kept > 0)


def without_specks(
    layers: NDArray[np.float32],
    steady: NDArray[np.bool_],
    region: NDArray[np.bool_] | None = None,
    reach: float = SPECK_WIDTH,
) -> NDArray[np.float32]:
    """Return layers (groups, h, w, 3) with the light of lone bright pixels spread over the pixels
    around them, so that its sum does not change. Light that is subtracted is spread likewise.

    Args:
        steady: mask (h, w) of pixels that keep their light.
        region: mask (h, w) of the pixels over which it is spread, and outside of which pixels keep
            their light, too; all pixels by default.
        reach: width over which it is spread, as a fraction of the image width.
    """
    side = round(reach * layers.shape[2]) | 1  # an odd side: a symmetric square loses no light
    region = np.ones_like(steady) if region is None else region
    found = layers.copy()
    if region.any():
        # The margin holds what the kernel and the comparison with neighbours reach.
        part = box_around(region, max(side, LONE_WINDOW) // 2)
        found[:, *part] = _spread(layers[:, *part], steady[part], region[part], side)
    return found


def _spread(
    layers: NDArray[np.float32],
    steady: NDArray[np.bool_],
    region: NDArray[np.bool_],
    side: int,
) -> NDArray[np.float32]:
    """Return layers as `without_specks` does, with a kernel of two squares of a side (pixels)."""

    # With these factors (h, w) on both sides of the kernel, its sum is 1 for the light that leaves
    # a pixel, and nearly so for the light that arrives: even light stays even at an edge.
    arriving = leaving = region.astype(np.float64)
    for _ in range(BALANCING_STEPS):
        arriving = np.sqrt(arriving * leaving)
        near = averaged_twice(arriving, side)
        leaving = np.divide(1.0, near, out=np.zeros_like(near), where=region)
    spread = np.zeros_like(layers)
    for layer, found in zip(layers, spread, strict=True):
        bright = layer.sum(axis=-1)
        left = _left_of_lone(np.maximum(bright, 0))
        if bright.min() < 0:
            left -= _left_of_lone(np.maximum(-bright, 0))
        left = np.where(steady | ~region, bright, left)
        kept = np.divide(left, bright, out=np.ones_like(bright), where=bright != 0)[..., None]
        lone = layer * (1.0 - kept)
        if not lone.any():
            found[...] = layer
            continue
        for k in range(3):
            light = lone[..., k].astype(np.float64) * leaving
            found[..., k] = averaged_twice(light, side) * arriving
        if layer.min() >= 0:
            np.maximum(found, 0.0, out=found)  # rounding gives -1e-17
        found += layer * kept
    return spread


def _left_of_lone(bright: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return an image (h, w) in which lone bright pixels are limited by those around them."""
    company = ndimage.rank_filter(bright, -LONE_RANK, size=LONE_WINDOW, mode="constant")
    return np.asarray(np.minimum(bright, LONE_RATIO * company))
