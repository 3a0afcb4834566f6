"""Detection of the dots that are printed on a skin."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import black_tophat
from scipy.spatial import cKDTree

FloatArray = NDArray[np.float64]

REACH = 0.5
"""Distance from a dot's place at rest within which it is looked for, over that of its nearest
neighbour: two dots never look for each other."""
LEAST_REACH = 1.5
"""Pixels that a dot is looked for at least."""
FAINTEST = 0.3
"""Darkness over the greatest one near a dot from which pixels count as its own; lights' shades are
fainter than ink."""
LEAST_DARKNESS = 10.0
"""Levels of 255 by which a dot is darker than what is around it at least, several times the noise
of a camera."""


def dots_in_picture(picture: NDArray[np.uint8], at_rest: FloatArray) -> FloatArray:
    """Columns and rows of dots that have moved a little.

    What is darker than its surroundings, and smaller than the distance of dots, counts as a dot (a
    black top-hat transform); the centre of this darkness near its place at rest is its place.

    Args:
        picture: (h, w, 3), as the camera stored it.
        at_rest: (n, 2) column and row of each dot in the untouched picture, in pixels from the
            upper left corner; NaN where it is not seen.

    Returns:
        (n, 2) column and row; NaN where no dot is found.
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
