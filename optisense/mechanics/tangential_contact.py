"""Shear between an indenter that is dragged or turned and an elastic layer, with friction."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from optisense.errors import ContactError
from optisense.mechanics.convolution import GridResponse

FloatArray = NDArray[np.float64]

TOLERANCE = 1e-4
"""Change of the shear in a step, over the shear, at which the iteration ends."""
MAX_ITERATIONS = 1000
"""Iterations after which the solver gives up; contacts of 64 points across take 50 to 150."""


class Drag(NamedTuple):
    """How an indenter has moved along the skin since it was pressed in.

    Attributes:
        shift: (2,) mm along x and y of the tangent plane.
        twist: radians about the outward normal, counter-clockwise seen from outside.
    """

    shift: FloatArray
    twist: float

    def displacement(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """(2, rows, columns) mm that skin which sticks has moved, at (columns,) x and (rows,) y."""
        across, along = np.meshgrid(x, y)
        cosine, sine = np.cos(self.twist), np.sin(self.twist)
        return np.stack(
            [
                self.shift[0] + across - (cosine * across + sine * along),
                self.shift[1] + along - (cosine * along - sine * across),
            ]
        )


def solve_shear(
    response: GridResponse,
    pressure: FloatArray,
    friction: float,
    wanted: FloatArray,
    start: FloatArray | None = None,
) -> FloatArray:
    """The shear on a skin that sticks to an indenter where friction holds it, and slips elsewhere.

    The shear is nowhere larger than friction times pressure. Where it is smaller, the skin has
    moved with the indenter; where it is as large, it has moved less, and the shear points along the
    rest. This minimises a convex energy; the method is an accelerated projected gradient (Beck and
    Teboulle, SIAM J. Imaging Sci. 2, 2009) with restarts. What shear does to the pressure is left
    out, as usual: it vanishes for an incompressible half-space.

    Args:
        response: of the layer, on the grid.
        pressure: (rows, columns) MPa.
        friction: coefficient.
        wanted: (2, rows, columns) mm along x and y by which the indenter has moved.
        start: (2, rows, columns) MPa to begin with.

    Returns:
        (2, rows, columns) MPa on the skin.

    Raises:
        ContactError: the iteration does not converge.
    """
    limit = friction * pressure
    shear = np.zeros_like(wanted)
    if not limit.any() or not wanted.any():
        return shear
    if start is not None:
        shear = _within(start, limit)
    step = 1.0 / response.largest_sideways()
    ahead, momentum = shear, 1.0
    for _ in range(MAX_ITERATIONS):
        slope = response.sideways(ahead) - wanted
        found = _within(ahead - step * slope, limit)
        change = found - shear
        if ((ahead - found) * change).sum() > 0.0:  # the momentum leads astray: begin anew
            ahead, momentum = shear, 1.0
            continue
        after = 0.5 * (1.0 + np.sqrt(1.0 + 4.0 * momentum**2))
        ahead = found + (momentum - 1.0) / after * change
        momentum, shear = after, found
        if np.linalg.norm(change) <= TOLERANCE * np.linalg.norm(shear):
            return shear
    rest = float(np.linalg.norm(change) / np.linalg.norm(shear))
    raise ContactError(
        f"the shear under an indenter is not found in {MAX_ITERATIONS} iterations; its last change "
        f"was {100 * rest:.2g} %",
        hint="shift or turn the indenter less, or check its shape for spikes",
    )


def _within(shear: FloatArray, limit: FloatArray) -> FloatArray:
    """Shear (2, rows, columns) shortened to the limit (rows, columns) where it is longer."""
    size = np.hypot(shear[0], shear[1])
    factor = np.divide(limit, size, out=np.ones_like(size), where=size > limit)
    return np.asarray(shear * factor)
