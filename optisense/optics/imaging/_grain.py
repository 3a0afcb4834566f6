"""Pixels outside contacts for which one sample is too few: those at the outline of the skin, and
grain, which differs from its neighbours because each sample reads one cell of the radiance cache.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

GRAIN_SAMPLES = 4
"""Largest number of further camera samples per pixel in grainy places outside contacts, which
halves the grain; they are limited to half of the image's samples. A sample reads one cell of the
cache, so that neighbouring cells that differ much show as grain. Without them, the error outside
the contact of GelSight Svelte is 21 % larger (benchmarks/ablation.md)."""
OUTLINE_SAMPLES = 9
"""Number of camera samples per pixel at the outline of the skin, such as the edge of a
mirror, so that it is smooth, as in photographs. On GelSight Svelte, 1,200 of 76,800 pixels lie
there."""
GRAIN_THRESHOLD = 0.03
"""Threshold of the relative RMS deviation of pixels from the mean of their neighbours above which a
place is grainy: three times a camera's own noise, which is about 0.01."""
NEIGHBOUR_MEAN = np.array([[0, 1, 0], [1, 0, 1], [0, 1, 0]], dtype=np.float32) / 4
"""Convolution kernel that gives the mean of the four neighbours of a pixel."""
DARK_FRACTION = 0.02
"""Fraction of the mean brightness below which grain is ignored, as it is hardly visible in places
so dark."""
GRAIN_WINDOW = 9
"""Side (pixels) of the square over which grain is measured and resampled. The deviations of its 81
pixels give the root mean square to a tenth."""


def grainy(image: NDArray[np.float32], where: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return a mask (h, w) of the pixels of ``where`` that lie in grainy places.

    In these, the image (h, w) often differs from the mean of the four neighbours by more than a
    smooth image does.
    """
    if not where.any():
        return where
    inner = ndimage.binary_erosion(where) & (image > DARK_FRACTION * image[where].mean())
    mean = ndimage.convolve(image, NEIGHBOUR_MEAN, mode="nearest")
    # The lower bound avoids a division by zero at a lit pixel among black ones.
    least = np.maximum(0.01 * np.abs(image), np.finfo(np.float32).tiny)
    off = np.where(inner, (image - mean) / np.maximum(np.abs(mean), least), 0.0)
    share = ndimage.uniform_filter(inner.astype(np.float32), GRAIN_WINDOW)
    square = ndimage.uniform_filter((off**2).astype(np.float32), GRAIN_WINDOW)
    return where & (square > GRAIN_THRESHOLD**2 * np.maximum(share, 1e-6))


def outline(hit: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return a mask (h, w) of the pixels on both sides of the outline of a mask ``hit`` (h, w)."""
    return np.asarray(ndimage.binary_dilation(hit) & ndimage.binary_dilation(~hit))
