"""The exposure with which a sensor and its contacts are scored, and presses before it is known."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from optisense.design.responses import PictureChain
from optisense.objectives.press import Press

if TYPE_CHECKING:
    from optisense.optics import TactileImage

MOST_SATURATED = 0.02
"""Largest share of a contact's pixels that automatic exposure allows to be overexposed: on a shiny
sensor, the exposure is lowered until the highlights on contacts are small."""


def exposure_for(
    untouched: NDArray[np.float32],
    contacts: Iterable[NDArray[np.float32]],
    chain: PictureChain | None = None,
) -> float:
    """Return the automatic exposure for a sensor and its contacts.

    It is the automatic exposure of the untouched sensor (`auto_exposure`). If this would overexpose
    more than `MOST_SATURATED` of the pixels of a contact, it is lowered as little as needed.

    Args:
        untouched: (h, w, 3) radiance of the untouched sensor.
        contacts: (n, 3) radiance of the pixels of each contact, from `PictureChain.metered`.
        chain: picture chain of the camera; the default `PictureChain` if None.

    Returns:
        The factor from radiance to the camera's response.
    """
    response = chain or PictureChain()
    exposure = response.auto_exposure(untouched)
    for radiance in contacts:
        brightest = radiance.max(axis=1)
        kept = min(len(brightest) - 1, int((1.0 - MOST_SATURATED) * len(brightest)))
        level = float(np.partition(brightest, kept)[kept])
        if level * exposure > response.full_level():
            exposure = response.full_level() / level
    return exposure


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
