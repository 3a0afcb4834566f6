"""Detection of the dots that are printed on a skin."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import black_tophat
from scipy.spatial import cKDTree

from optisense.array_types import FloatArray

REACH = 0.5
"""Search radius around a dot's place at rest, over the distance to its nearest neighbour; with a
half, the search areas of two dots do not overlap."""
LEAST_REACH = 1.5
"""Smallest search radius of a dot, pixels; it includes the pixels beside the dot's place at rest
(at most the root of 2 away), from which its middle is computed."""
FAINTEST = 0.3
"""Darkness from which on pixels belong to a dot, over the greatest darkness near it; shading by
lights is fainter than ink."""
LEAST_DARKNESS = 10.0
"""Smallest difference (levels of 255) of a dot from its surroundings, above camera noise."""


def dots_in_picture(picture: NDArray[np.uint8], at_rest: FloatArray) -> FloatArray:
    """Locate dots that have moved a little.

    Areas that are darker than their surroundings and smaller than the distance of dots count as
    dots (a black top-hat transform). The position of a dot is the centre of this darkness near its
    place at rest.

    Args:
        picture: (h, w, 3) picture that the camera stored.
        at_rest: (n, 2) column and row of each dot in the untouched picture, in pixels from the
            upper left corner; NaN where it is not seen.

    Returns:
        The column and row (n, 2) of each dot; NaN where no dot is found.
    """
    result = np.full(at_rest.shape, np.nan)
    seen = np.flatnonzero(np.isfinite(at_rest).all(axis=1))
    if len(seen) < 2:
        return result
    distance = cKDTree(at_rest[seen]).query(at_rest[seen], 2)[0][:, 1]
    reaches = np.maximum(REACH * distance, LEAST_REACH)
    size = 2 * int(np.ceil(np.median(reaches))) + 1
    dark = black_tophat(picture.mean(axis=2), size=size)
    height, width = dark.shape
    for dot, reach in zip(seen, reaches, strict=True):
        column, row = at_rest[dot]
        left, right = max(int(column - reach), 0), min(int(column + reach) + 1, width)
        top, bottom = max(int(row - reach), 0), min(int(row + reach) + 1, height)
        window = dark[top:bottom, left:right]
        if not window.size or window.max() < LEAST_DARKNESS:
            continue
        weights = np.where(window >= FAINTEST * window.max(), window, 0.0)
        rows, columns = np.indices(window.shape) + 0.5
        total = weights.sum()
        result[dot] = (
            left + (weights * columns).sum() / total,
            top + (weights * rows).sum() / total,
        )
    return result
