"""Comparison of renderings that may differ by the order of threads."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

ROUNDING = 2e-5
"""Largest difference relative to the image's mean: sums of some thousand single-precision numbers
in any order."""

TURNED_RAYS = 1e-3, 0.01
"""Part of an image's pixels where such rounding may draw another shadow ray, and what that may
change, relative to the mean. One pixel of 4,800 was seen to change by 8e-4."""

TURNED_BESIDE_CONTACT = 0.2
"""What one or two shadow rays may change on the bent skin beside a contact, relative to the mean: a
pixel has six samples of 16 shadow rays each for a light group there, so that one is 1.7 % of it. A
pixel 3.5 times as bright as the mean was seen to change by 0.11; some have 6 times the mean."""

LEAST_TURNED = 12
"""So many pixels may change in small images too: a photon of the radiance cache that rounding sent
elsewhere was seen to change 8 of 4,800, by 3e-4 of the mean."""

SCORE_ROUNDING = 1e-3
"""Largest relative difference of a score over some hundred pixels, in one of which a shadow ray
changed."""

LEVELS = 8
"""What a turned shadow ray may change in a dark pixel of a picture, of 255 levels: 1 % of the mean,
where the curve of sRGB is steepest (12.9)."""


def same_light(
    one: NDArray[np.floating], other: NDArray[np.floating], most: float = TURNED_RAYS[1]
) -> bool:
    """Whether two images of the same photons are equal but for the order of sums.

    Args:
        one, other: (..., c) radiance or response of the same pixels.
        most: what a turned shadow ray may change, relative to the mean.
    """
    off = np.abs(one.astype(float) - other).max(axis=-1) / other.mean(dtype=float)
    part, _ = TURNED_RAYS
    turned = off > ROUNDING
    same = bool(off.max() <= most and turned.sum() <= max(LEAST_TURNED, part * off.size))
    if not same:
        worst = np.unravel_index(int(off.argmax()), off.shape)
        print(  # pytest shows it where a test fails
            f"{int(turned.sum())} of {off.size} pixels differ by more than {ROUNDING:g} of the"
            f" mean, by {off.max():.2g} at most, at {tuple(int(each) for each in worst)};"
            f" median {np.median(off):.2g}, mean {off.mean():.2g}"
        )
    return same


def same_pictures(one: NDArray[np.uint8], other: NDArray[np.uint8]) -> bool:
    """The same for pictures of 8 bits, where one level may also round otherwise.

    Args:
        one, other: (h, w, 3) values of 0 to 255.
    """
    off = np.abs(one.astype(int) - other).max(axis=2)
    part, _ = TURNED_RAYS
    return bool(off.max() <= LEVELS and (off > 1).sum() <= max(LEAST_TURNED, part * off.size))
