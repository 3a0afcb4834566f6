"""Framing: the perspective view in which given points fill the free part of a window."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

ROOM = 0.86
"""Share of the free part of a view that the sensor fills, with room for header and gizmos."""

ROUNDS = 12
"""Number of iterations of the fit. Near points grow faster than far ones, so one step is not
enough; after twelve steps no point moves by a pixel.
"""

NEAREST = 0.2
"""Smallest distance of a point from the eye, as a share of the distance between the eye and the
centre of the view.
"""


class Fit(NamedTuple):
    """Centre of a view and the eye's distance from it, mm."""

    location: NDArray[np.float64]
    distance: float


def on_screen(
    points: ArrayLike, axes: ArrayLike, fit: Fit, focal: float, size: tuple[float, float]
) -> NDArray[np.float64]:
    """Return where a view shows points, (n, 2) pixels from its lower left corner.

    Args:
        points: positions, (n, 3) mm.
        axes: rows of the view's rotation, (3, 3): right, up, and the direction back to the eye.
        fit: centre of the view and distance of the eye.
        focal: focal length in pixels.
        size: width and height of the view, pixels.
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
    """Return the centre and distance of the view in which points fill its free part.

    Args:
        points: positions, (n, 3) mm.
        axes: rows of the view's rotation, (3, 3): right, up, and the direction back to the eye.
        focal: focal length in pixels.
        size: width and height of the view, pixels.
        free: left and right limits of the free part, pixels from the left edge.
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
