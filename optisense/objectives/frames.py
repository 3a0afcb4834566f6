"""Positions of presses: the frame of each, and the press that a pixel belongs to."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from optisense.geometry import Contact, SensingSurface, Sphere, locate


class PressFrame(NamedTuple):
    """Frame of a press: place (3,), mm, on the untouched surface, inward normal (3,), compass
    directions (3,), and the ball's centre (3,), mm.
    """

    place: NDArray[np.float64]
    inward: NDArray[np.float64]
    east: NDArray[np.float64]
    north: NDArray[np.float64]
    centre: NDArray[np.float64]


def press_frame(contact: Contact, surface: SensingSurface) -> PressFrame:
    """Return the frame of a press of a ball."""
    assert isinstance(contact.indenter, Sphere)
    spot = locate(contact, surface)
    east, _ = surface.tangents(spot.inward)
    return PressFrame(
        place=spot.point,
        inward=spot.inward,
        east=east,
        north=np.cross(spot.inward, east),
        centre=spot.point + (contact.depth - contact.indenter.radius) * spot.inward,
    )


def nearest_press(
    points: NDArray[np.float32], mask: NDArray[np.bool_], centres: ArrayLike
) -> NDArray[np.int64]:
    """Return the number (h, w) of the press whose centre (of n, (n, 3) mm) is nearest to the point
    that a pixel of the mask sees; -1 elsewhere.
    """
    owner = np.full(mask.shape, -1, dtype=np.int64)
    seen = points[mask].astype(np.float64)
    owner[mask] = np.linalg.norm(seen[:, None] - np.asarray(centres), axis=2).argmin(axis=1)
    return owner
