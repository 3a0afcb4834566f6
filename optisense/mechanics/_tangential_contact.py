"""Shear between an indenter that is dragged or turned and an elastic layer, with friction."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from optisense.array_types import FloatArray
from optisense.errors import ContactError
from optisense.mechanics._convolution import GridResponse

TOLERANCE = 1e-4
"""Relative change of the shear (root of the sum of squares) in a step at which the iteration ends,
far below the accuracy of friction coefficients."""
MAX_ITERATIONS = 1000
"""Number of iterations after which the solver fails; contacts 64 points wide take 50 to 150."""


class Drag(NamedTuple):
    """The motion of an indenter along the skin after it was pressed in.

    Attributes:
        shift: (2,) translation along x and y of the tangent plane, mm.
        twist: rotation (radians) about the outward normal, counter-clockwise seen from outside.
    """

    shift: FloatArray
    twist: float

    def displacement(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Return the displacement (2, rows, columns), mm, of sticking skin at x and y.

        It is that of many small turns in a row, all about the places where the skin is at rest: the
        twist times the distance from the axis, at right angles to it. The chord of the whole turn
        would vanish after a full one, and the torque with it.
        """
        across, along = np.meshgrid(x, y)
        return np.stack([self.shift[0] - self.twist * along, self.shift[1] + self.twist * across])


def solve_shear(
    response: GridResponse,
    pressure: FloatArray,
    friction: float,
    wanted: FloatArray,
    start: FloatArray | None = None,
) -> FloatArray:
    """Return the shear (2, rows, columns), MPa, on a skin under a pressure (rows, columns) that
    sticks to an indenter where friction suffices, and slips elsewhere.

    The shear is nowhere larger than friction times pressure. Where it is smaller, the skin has
    moved with the indenter; where it is equal, the skin has moved less, and the shear points along
    the difference. This minimises a convex energy; the method is an accelerated projected gradient
    (Beck and Teboulle, SIAM J. Imaging Sci. 2, 2009) with restarts. The effect of shear on the
    pressure is neglected, as usual; it vanishes for an incompressible half-space. The indenter
    moves as ``wanted`` (2, rows, columns), mm.

    Raises:
        ContactError: the iteration does not converge.
    """
    limit = friction * pressure
    shear = np.zeros_like(wanted)
    if not limit.any() or not wanted.any():
        return shear
    if start is not None:
        shear = _within(start, limit)
    step = 1.0 / response.largest_tangential()
    ahead, momentum = shear, 1.0
    for _ in range(MAX_ITERATIONS):
        slope = response.tangential(ahead) - wanted
        found = _within(ahead - step * slope, limit)
        change = found - shear
        if ((ahead - found) * change).sum() > 0.0:  # the momentum points uphill: restart
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
        hint="Shift or turn the indenter less, or check its shape for spikes",
    )


def _within(shear: FloatArray, limit: FloatArray) -> FloatArray:
    """Return shear (2, rows, columns), limited in length to ``limit`` (rows, columns)."""
    size = np.hypot(shear[0], shear[1])
    factor = np.divide(limit, size, out=np.ones_like(size), where=size > limit)
    return np.asarray(shear * factor)
