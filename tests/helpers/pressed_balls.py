"""Balls pressed into ideal sensors, whose scores follow from algebra."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from optisense.objectives import Press

RADIUS = 1.5


def pressed_ball(
    colour: Callable[[np.ndarray], np.ndarray],
    depth: float = 0.3,
    pixels: int = 201,
    shear: tuple[float, float] = (0.0, 0.0),
    stretch: float = 1.0,
    turned: float = 0.0,
    number: int = 1,
) -> Press:
    """A ball seen from straight above, in parallel projection.

    Args:
        colour: (n, 3) linear response of (n, 3) normals.
        depth: mm. pixels: across the image, which is a little larger than the contact.
        shear, stretch: of the picture, as a camera that looks askance makes it.
        turned: degrees that the whole scene is turned about the x axis.
        number: of the place.
    """
    reach = 1.1 * np.sqrt(depth * (2 * RADIUS - depth)) * (1 + sum(shear)) / min(1.0, stretch)
    steps = np.linspace(-reach, reach, pixels)
    column, row = np.meshgrid(steps, -steps)
    x = column + shear[0] * row
    y = stretch * (row + shear[1] * column)
    inside = x**2 + y**2 < depth * (2 * RADIUS - depth)
    # The ball's centre is the origin; its lowest part points along z, into the gel.
    z = np.sqrt(np.maximum(RADIUS**2 - x**2 - y**2, 0))
    points = np.stack([x, y, z], axis=-1)
    normals = points / RADIUS
    a = np.radians(turned)
    turn = np.array([[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]])
    response = np.zeros((*inside.shape, 3), dtype=np.float32)
    response[inside] = colour(normals[inside])
    return Press(
        number=number,
        place=turn @ [0, 0, RADIUS - depth],
        inward=turn[:, 2],
        east=turn[:, 0],
        north=turn[:, 1],
        centre=np.zeros(3),
        mask=inside,
        response=response,
        normals=np.where(inside[..., None], normals @ turn.T, np.nan).astype(np.float32),
        points=np.where(inside[..., None], points @ turn.T, np.nan).astype(np.float32),
        before=np.broadcast_to(turn[:, 2], (*inside.shape, 3)).astype(np.float32),
    )


class Presses:
    """Stands for an evaluation whose presses are given."""

    def __init__(self, *presses: Press) -> None:
        self.presses = list(presses)
