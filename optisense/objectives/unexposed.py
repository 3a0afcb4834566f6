"""Presses before they are exposed, and what of their images is looked at."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from optisense.objectives.press import Press

if TYPE_CHECKING:
    from optisense.optics import TactileImage

GAP = 0.5
"""mm that must be free between contacts which share an image."""


class UnexposedPress(NamedTuple):
    """A press with the n pixels of (h, w) that contacts touch in its image, and the radiance (n, 3)
    there."""

    press: Press
    touched: NDArray[np.bool_]
    radiance: NDArray[np.float32]


def radiance_in(image: TactileImage, where: NDArray[np.bool_]) -> NDArray[np.float32]:
    """(n, 3): `image.radiance` of the n pixels of a mask alone."""
    total = np.zeros((np.count_nonzero(where), 3), dtype=np.float32)
    for layer in image.layers.values():
        total += layer[where]
    return total


def box_around(mask: NDArray[np.bool_], reach: int) -> tuple[slice, slice]:
    """Rows and columns of a mask's true pixels and of those within `reach` of them."""
    rows, columns = (np.flatnonzero(mask.any(axis=axis)) for axis in (1, 0))
    return (
        slice(max(0, rows[0] - reach), rows[-1] + 1 + reach),
        slice(max(0, columns[0] - reach), columns[-1] + 1 + reach),
    )


def are_apart(places: Sequence[NDArray[np.float64]], radius: float, depth: float) -> bool:
    """Whether balls of a radius, pressed in so deep (mm) at places (3,) mm, leave `GAP` between
    their contacts.
    """
    width = 2.0 * np.sqrt(depth * (2.0 * radius - depth)) + GAP
    points = np.array(places)
    distances = np.linalg.norm(points[:, None] - points, axis=2)
    return bool((distances + np.eye(len(points)) * 2 * width > width).all())
