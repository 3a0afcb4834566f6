"""Noise of the radiance cache, relative to its light."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix

from optisense.array_types import FloatingArray

NOISIEST_SHARE = 0.05
"""Share of the area in view that counts as the worst places when their noise is reported: small
enough to find a dark corner, and large enough not to depend on a few cells."""
PATCH_AVERAGES = 4
"""Number of times that the squared noise is averaged with the smoothing kernel, which widens the
kernel twofold. Without averaging it is the square of a single difference, and chance would decide
which places are the worst."""
DARKEST_JUDGED = 0.1
"""Lower bound on the light to which a place's noise is relative, as a share of the mean light, so
that very dark places do not decide the result."""


def relative_noise(light: FloatingArray, square: FloatingArray) -> float:
    """Return the relative RMS noise (1 = 100 %) over cells and light groups.

    Args:
        light: (cells, groups) irradiance, mW/mm^2.
        square: (cells, groups) its squared standard deviation.
    """
    scale = light.mean(axis=0)
    lit = scale > 0
    if not lit.any():
        return 0.0
    return float(np.sqrt((square[:, lit] / scale[lit] ** 2).mean()))


def noise_of_worst_places(
    light: FloatingArray,
    square: FloatingArray,
    near: NDArray[np.bool_],
    areas: FloatingArray,
    kernel: csr_matrix,
) -> float:
    """Return the relative RMS noise (1 = 100 %) that the noisiest 5 % of the area have at least.

    Args:
        light: (cells, groups) irradiance, mW/mm^2.
        square: (cells, groups) its squared standard deviation.
        near: (cells,) mask of the cells that count.
        areas: (cells,) areas, mm^2.
        kernel: (cells, cells) the kernel that smooths the light.
    """
    scale = light[near].mean(axis=0)
    lit = scale > 0
    if not lit.any():
        return 0.0
    noise = (square[:, lit] / scale[lit] ** 2).mean(axis=1)
    brightness = (light[:, lit] / scale[lit]).mean(axis=1)
    for _ in range(PATCH_AVERAGES):
        noise = kernel @ (noise * areas)
    relative = np.sqrt(noise[near]) / np.maximum(brightness[near], DARKEST_JUDGED)
    order = np.argsort(relative)
    share = np.cumsum(areas[near][order]) / areas[near].sum()
    return float(relative[order][np.searchsorted(share, 1.0 - NOISIEST_SHARE)])
