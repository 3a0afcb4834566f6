"""Sizes of the errors that fits to photographs expect, by which they divide their residuals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from optisense.array_types import FloatArray
from optisense.calibration._correlated_errors import PHOTOGRAPH_NOISE, ErrorScale, error_scale
from optisense.calibration._covered_view import SkinOutline

OUTLINE_ERROR = 0.08
"""Expected error of a pixel at the outline of the skin, relative to the difference between skin and
rest there: the RMS of simulated GelSight360 and GelSight Svelte, whose true designs were known."""

NOISE_EXTENT = 6.0
"""Standard deviation, pixels, of the neighbourhood over which squares of the noise of the light are
averaged: there is only one sample of it, and shadows, where it changes, are about as wide.
"""


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
        masks: Sequence[NDArray[np.bool_]],
        pixels: float | None,
    ) -> Scales:
        """Return the scales of errors, unaffected by dust.

        Args:
            errors: errors (h, w, 3) of the background and of each response, levels.
            masks: (h, w) masks of the pixels of each response that count.
            pixels: see `RoughFit`; None estimates it from the errors.
        """
        ground, *pressed = (error / own for error, own in zip(errors, expected, strict=True))
        everywhere = np.ones(ground.shape[:2], dtype=bool)
        return Scales(
            list(expected),
            error_scale([ground], [everywhere], pixels),
            error_scale(pressed, masks, pixels),
        )


def expected_errors(
    background: FloatArray, noise: Sequence[FloatArray], outline: SkinOutline | None
) -> list[FloatArray]:
    """Return the expected errors (h, w, 3) of the background and of the responses, in levels.

    They come from the noise of the photographs and of the light, and, at the outline of the skin,
    from the brightness of the skin, which is that of the nearest pixel inside.

    Args:
        background: (h, w, 3) the model's background, levels.
        noise: a sample (h, w, 3) of the light's noise in the background and in each response.
        outline: outline of the skin, if its share of pixels is known.
    """
    window = (NOISE_EXTENT, NOISE_EXTENT, 0.0)
    expected = [np.sqrt(PHOTOGRAPH_NOISE**2 + gaussian_filter(each**2, window)) for each in noise]
    if outline is not None:
        (contrast,) = outline.contrast(background[None])
        expected[0][outline.where] = np.hypot(expected[0][outline.where], OUTLINE_ERROR * contrast)
    return expected
