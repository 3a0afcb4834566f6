"""Field of a picture far from a contact, where a press changes nothing.

The difference between a photograph and the background contains the response of the contact, noise,
and a drift: cameras and lights change by about a level while they warm up, equally in the whole
picture. The far field shows the drift, which is no property of the sensor's design.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from optisense.array_types import FloatArray

FAR = 3.0
"""Distance beyond which a press should change nothing, in radii of the contact: well outside the
ring, where the skin is pulled in."""

LEAST_SHARE = 0.1
"""Smallest share of the picture's pixels from which a drift is determined; a smaller far field does
not show whether a difference is uniform."""

NOISE_REACH = 3
"""Distance, in pixels, at which the noise of photographs is uncorrelated: that of published ones of
a GelSight Mini, averaged to 320 pixels, has a correlation below 0.01 there."""


def without_drift(difference: FloatArray, distance: FloatArray) -> FloatArray:
    """Return the response in a photograph: its difference (h, w, 3) from the background, levels,
    without the drift. Distances (h, w) are those from the contact's middle, in its radii.
    """
    return difference - drift(difference, distance)


def drift(difference: FloatArray, distance: FloatArray) -> FloatArray:
    """Return the mean difference (3,) of R, G and B in the far field; 0 if it is too small."""
    far = distance > FAR
    if far.mean() < LEAST_SHARE:
        return np.zeros(difference.shape[-1])
    return np.asarray(difference[far].mean(axis=0))


def without_noise(error: FloatArray, where: NDArray[np.bool_]) -> float:
    """Return the root mean square of the part of an error (h, w, 3), in levels, that is no noise,
    over the pixels of a mask (h, w).

    Noise has no correlation between pixels at a distance, and smooth errors have. So the mean
    product of such pixels is the mean square of the smooth part; with noise alone it is about 0.
    """
    reach = NOISE_REACH
    products = [
        (error[:-reach] * error[reach:])[where[:-reach] & where[reach:]],
        (error[:, :-reach] * error[:, reach:])[where[:, :-reach] & where[:, reach:]],
    ]
    pairs = np.concatenate(products)
    return math.sqrt(max(float(pairs.mean()), 0.0)) if pairs.size else 0.0
