"""A perspective view that is moved until what it shows fills a part of it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

ROOM = 0.86
"""Share of the free part of a view that the sensor fills; its head and gizmos stay beside it."""

ROUNDS = 12
"""The number of times that a view is fitted: nearer things grow faster, and after twelve times
nothing moves by a pixel any more."""

NEAREST = 0.2
"""Share of the distance between eye and middle: nothing is taken to be nearer to the eye."""


class Fit(NamedTuple):
    """The point that a view looks at and its distance, mm."""

    location: NDArray[np.float64]
    distance: float


def on_screen(
    points: ArrayLike, axes: ArrayLike, fit: Fit, focal: float, size: tuple[float, float]
) -> NDArray[np.float64]:
    """(n, 2) pixels from the lower left where a view shows points.

    Args:
        points: (n, 3) mm.
        axes: (3, 3) rows: the view's right, up, and the way back to the eye.
        fit: where it looks.
        focal: pixels, the focal length.
        size: pixels, width and height of the view.
    """
    x, y, back = np.asarray(axes) @ (np.asarray(points, dtype=np.float64) - fit.location).T
    depth = np.maximum(fit.distance - back, NEAREST * fit.distance)
    return np.stack([size[0] / 2 + focal * x / depth, size[1] / 2 + focal * y / depth], axis=1)


def fitted(
    points: ArrayLike,
    axes: ArrayLike,
    focal: float,
    size: tuple[float, float],
    free: tuple[float, float],
) -> Fit:
    """Return where a view has to look so that points fill the free part of it.

    Args:
        points: (n, 3) mm.
        axes: (3, 3) rows: the view's right, up, and the way back to the eye.
        focal: pixels, the focal length.
        size: pixels, width and height of the view.
        free: pixels from the left, where the free part begins and ends.
    """
    places, frame = np.asarray(points, dtype=np.float64), np.asarray(axes, dtype=np.float64)
    low, high = places.min(axis=0), places.max(axis=0)
    room = np.array([max(free[1] - free[0], 1.0), size[1]]) * ROOM
    across = max(float(np.linalg.norm(high - low)), 1e-6)
    fit = Fit((low + high) / 2, focal * across / room.min())
    wanted = np.array([(free[0] + free[1]) / 2, size[1] / 2])
    for _ in range(ROUNDS):
        seen = on_screen(places, frame, fit, focal, size)
        shift = ((seen.min(axis=0) + seen.max(axis=0)) / 2 - wanted) * fit.distance / focal
        moved = Fit(fit.location + shift @ frame[:2], fit.distance)
        seen = on_screen(places, frame, moved, focal, size)
        share = float(((seen.max(axis=0) - seen.min(axis=0)) / room).max())
        fit = Fit(moved.location, moved.distance * max(share, NEAREST))
    return fit
