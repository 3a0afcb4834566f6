"""The noise of a sensor's camera, on the picture that it stores."""

from __future__ import annotations

import numpy as np

from optisense.array_types import ByteArray

MEASURED_NOISE = 1.5
"""Standard deviation, in levels of 255: published ball presses of a real GelSight Mini show 1.1 to
1.9 between frames of one press."""


def add_camera_noise(picture: ByteArray, noise: float, seed: int | list[int]) -> ByteArray:
    """Add independent Gaussian noise to each pixel and channel of a picture (h, w, 3).

    Args:
        picture: the encoded picture, uint8.
        noise: standard deviation in levels of 255; 0 for none.
        seed: seed of NumPy's default generator.

    Returns:
        The picture with noise, uint8, rounded and clipped.
    """
    if noise <= 0:
        return picture
    change = np.random.default_rng(seed).normal(0.0, noise, picture.shape)
    return np.clip(np.round(picture + change), 0, 255).astype(np.uint8)
