"""Sizes of the errors that fits to photographs expect, and the extent of their correlation.

Neighbouring pixels have similar errors if the model is wrong, or if its light is noisy: both are
smooth. So a picture contains fewer independent errors than pixels. If each pixel counted as one, a
smooth error of the background would outweigh the contacts, and uncertainties would be too small.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfft2, next_fast_len, rfft2
from scipy.ndimage import gaussian_filter

from optisense.array_types import FloatArray
from optisense.calibration._covered_view import SkinOutline

HUBER = 2.0
"""Residual, in units of the usual error, beyond which it counts linearly instead of quadratically
(Huber 1964): 5 % of normally distributed residuals are larger.
"""

UNCORRELATED = 0.1
"""Correlation below which errors at a distance are regarded as independent: the estimate from one
picture scatters by about as much.
"""

FARTHEST = 0.2
"""Largest distance over which a correlation is summed, as a share of the picture's width. Without
it, a model that is wrong everywhere would not be fitted to the background at all."""

PHOTOGRAPH_NOISE = 1.0
"""Expected noise of a photograph that is averaged to half its width, levels."""

TO_DEVIATION = 1.4826
"""Ratio of the standard deviation of a normal distribution to the median of its absolute values,
one over its third quartile, 0.6745."""

LEAST_PIXELS = 9.0
"""Smallest number of pixels for which there is one independent error: cameras interpolate colours
from neighbouring pixels, and dust and overexposure bias more than the residuals show.
"""

SCALE_CHANGE = 0.1
"""Relative difference up to which two scales of errors are alike: the weights of the residuals then
change by less than a fifth, and another descent hardly changes the fit."""

OUTLINE_ERROR = 0.08
"""Expected error of a pixel at the outline of the skin, relative to the difference between skin and
rest there: the RMS of simulated GelSight360 and GelSight Svelte, whose true designs were known."""

NOISE_EXTENT = 6.0
"""Standard deviation, pixels, of the neighbourhood over which squares of the noise of the light are
averaged: there is only one sample of it, and shadows, where it changes, are about as wide.
"""


Pixels = NDArray[np.bool_] | slice
"""Pixels of a picture (h, w) that are compared: a mask (h, w), or a slice of rows, so that all
pixels need no copy."""


@dataclass(frozen=True)
class ErrorScale:
    """Errors of a set of pictures, relative to those that are expected from noise.

    Attributes:
        size: robust estimate of their standard deviation, at least 1.
        pixels: number of pixels for which there is one independent error.
    """

    size: float
    pixels: float

    def like(self, other: ErrorScale) -> bool:
        """Return whether both numbers are close to those of another scale."""
        pairs = ((self.size, other.size), (self.pixels, other.pixels))
        return all(abs(one - two) < SCALE_CHANGE * two for one, two in pairs)


def correlated_pixels(errors: Sequence[FloatArray], masks: Sequence[Pixels]) -> float:
    """Return the number of pixels for which there is one independent error, 1 or more, from errors
    (h, w, 3) of pictures and the pixels that count in each.

    It is the sum of the correlation over all displacements, up to the distance at which the mean
    over the directions falls below 0.1, and at most a fifth of the picture's width.
    """
    height, width = errors[0].shape[:2]
    shape = next_fast_len(2 * height, real=True), next_fast_len(2 * width, real=True)
    products, pairs = np.zeros(shape), np.zeros(shape)
    for error, mask in zip(errors, masks, strict=True):
        inside, counts = np.zeros_like(error), np.zeros((height, width))
        inside[mask], counts[mask] = error[mask], 1.0
        for channel in range(inside.shape[-1]):
            products += irfft2(np.abs(rfft2(inside[..., channel], shape)) ** 2, shape)
        pairs += inside.shape[-1] * irfft2(np.abs(rfft2(counts, shape)) ** 2, shape)
    if products[0, 0] <= 0.0:
        return 1.0
    known = pairs > 0.5
    correlation = np.where(known, products / np.maximum(pairs, 1.0), 0.0)
    correlation /= correlation[0, 0]
    rows, columns = (np.minimum(np.arange(size), size - np.arange(size)) for size in shape)
    distance = np.hypot(rows[:, None], columns[None, :])
    rings = np.round(distance).astype(np.int64)
    weights = np.where(known, pairs, 0.0).ravel()
    count = np.maximum(np.bincount(rings.ravel(), weights), 1e-12)
    profile = np.bincount(rings.ravel(), weights * correlation.ravel()) / count
    limit = max(round(FARTHEST * width), 1)
    below = np.flatnonzero(profile[:limit] < UNCORRELATED)
    near = rings < (below[0] if below.size else limit)
    return max(float(correlation[near & known].sum()), 1.0)


def error_scale(
    errors: Sequence[FloatArray],
    masks: Sequence[Pixels],
    pixels: float | None = None,
) -> ErrorScale:
    """Return the scale of errors (h, w, 3), relative to the expected ones, at the pixels of masks,
    unaffected by dust.

    Errors above `HUBER` are reduced to it in the estimate of their correlation, which is made if
    the number of pixels for one independent error is None.
    """
    inside = np.concatenate([error[mask] for error, mask in zip(errors, masks, strict=True)])
    size = max(TO_DEVIATION * float(np.median(np.abs(inside))), 1.0)
    if pixels is None:
        limited = [np.clip(error, -HUBER * size, HUBER * size) for error in errors]
        pixels = max(correlated_pixels(limited, masks), LEAST_PIXELS)
    return ErrorScale(size, pixels)


@dataclass(frozen=True)
class Scales:
    """Sizes of the errors.

    Attributes:
        expected: errors (h, w, 3) of the background and of each response that are expected from
            noise, levels.
        ground, pressed: ratio of the errors of the background and of the responses to the expected
            ones, and the extent over which they are correlated.
    """

    expected: list[FloatArray]
    ground: ErrorScale
    pressed: ErrorScale

    def of(self, index: int) -> ErrorScale:
        """Return the scale of the background (index -1) or of a press."""
        return self.ground if index < 0 else self.pressed

    def like(self, other: Scales) -> bool:
        """Return whether the scales are close to others."""
        return self.ground.like(other.ground) and self.pressed.like(other.pressed)

    @staticmethod
    def of_errors(
        errors: Sequence[FloatArray],
        expected: Sequence[FloatArray],
        masks: Sequence[Pixels],
        pixels: float | None,
    ) -> Scales:
        """Return the scales of errors (h, w, 3) of the background and of each response, levels, at
        the pixels of masks; `pixels` is that of `LayeredFit`.
        """
        ground, *pressed = (error / own for error, own in zip(errors, expected, strict=True))
        return Scales(
            list(expected),
            error_scale([ground], masks[:1], pixels),
            error_scale(pressed, masks[1:], pixels),
        )


def expected_errors(
    background: FloatArray, noise: Sequence[FloatArray], outline: SkinOutline | None
) -> list[FloatArray]:
    """Return the expected errors (h, w, 3) of the background and of the responses, in levels.

    They come from the noise of the photographs and of the light, of which there is a sample (h, w,
    3) for each, and, at the outline of the skin, from the brightness of the skin, which is that of
    the nearest pixel inside.
    """
    window = (NOISE_EXTENT, NOISE_EXTENT, 0.0)
    expected = [np.sqrt(PHOTOGRAPH_NOISE**2 + gaussian_filter(each**2, window)) for each in noise]
    if outline is not None:
        (contrast,) = outline.contrast(background[None])
        expected[0][outline.where] = np.hypot(expected[0][outline.where], OUTLINE_ERROR * contrast)
    return expected
