"""Presses before they are exposed, and the parts of their images that are read."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from optisense.objectives._press import Press

if TYPE_CHECKING:
    from optisense.optics import TactileImage

GAP = 0.5
"""Smallest distance (mm) between contacts that share an image: more than a pixel of every built-in
sensor, so that no pixel sees two contacts."""


class UnexposedPress(NamedTuple):
    """A press with the mask (h, w) of the pixels that contacts touch, and their radiance (n, 3)."""

    press: Press
    touched: NDArray[np.bool_]
    radiance: NDArray[np.float32]


def radiance_in(image: TactileImage, where: NDArray[np.bool_]) -> NDArray[np.float32]:
    """Return `image.radiance` (n, 3) of the n pixels of a mask, computed for these only."""
    total = np.zeros((np.count_nonzero(where), 3), dtype=np.float32)
    for layer in image.layers.values():
        total += layer[where]
    return total


def box_around(mask: NDArray[np.bool_], reach: int) -> tuple[slice, slice]:
    """Return the box (rows, columns) around a mask (h, w), extended by `reach` pixels."""
    rows, columns = (np.flatnonzero(mask.any(axis=axis)) for axis in (1, 0))
    return (
        slice(max(0, rows[0] - reach), rows[-1] + 1 + reach),
        slice(max(0, columns[0] - reach), columns[-1] + 1 + reach),
    )


def are_apart(places: Sequence[NDArray[np.float64]], radius: float, depth: float) -> bool:
    """Return whether the contacts of balls at several places are at least `GAP` apart.

    Args:
        places: (3,) places of the balls, mm.
        radius: radius of the balls, mm.
        depth: depth of the presses, mm.
    """
    width = 2.0 * np.sqrt(depth * (2.0 * radius - depth)) + GAP
    points = np.array(places)
    distances = np.linalg.norm(points[:, None] - points, axis=2)
    return bool((distances + np.eye(len(points)) * 2 * width > width).all())
