"""Pressure between a rigid indenter and an elastic layer, without friction."""

from __future__ import annotations

import numpy as np

from optisense.array_types import FloatArray
from optisense.errors import ContactError
from optisense.mechanics._convolution import GridResponse

TOLERANCE = 2e-4
"""Ratio of the largest remaining gap or overlap inside the contact to the largest initial overlap
at which the iteration ends: 0.16 micrometres for a press of 0.8 mm."""
MAX_ITERATIONS = 400
"""Number of iterations after which the solver fails; smooth contacts take 30, rough ones 100."""


def solve_normal_contact(
    response: GridResponse,
    overlap: FloatArray,
    start: FloatArray | None = None,
    tolerance: float = TOLERANCE,
) -> FloatArray:
    """Return the pressure (rows, columns), MPa, that keeps the skin from penetrating an indenter.

    The pressure is nowhere negative, the displacement equals the overlap where there is pressure,
    and is at least the overlap elsewhere. It minimises the complementary energy; the method is the
    constrained conjugate gradient of Polonsky and Keer, "A numerical method for solving rough
    contact problems", Wear 231 (1999), for a given approach in place of a given force.

    The overlap (rows, columns) is the depth (mm) of the undeformed skin inside the indenter,
    negative where there is a gap. Interim results have a tolerance above `TOLERANCE`.

    Raises:
        ContactError: the iteration does not converge.
    """
    deepest = float(overlap.max())
    if deepest <= 0.0:
        return np.zeros_like(overlap)
    pressure = np.zeros_like(overlap) if start is None else start.copy()
    displacement = response.normal(pressure) if start is not None else pressure
    way = np.zeros_like(overlap)
    before, goes_on = 1.0, False
    for iteration in range(1, MAX_ITERATIONS + 1):
        if not pressure.any():  # no start, or one so large that a step took all of it
            pressure, displacement = _first(response, overlap)
            goes_on = False
        gap = displacement - overlap
        touching = pressure > 0.0
        residual = np.where(touching, gap, 0.0)
        square = float((residual**2).sum())
        if (
            iteration > 1
            and np.abs(residual).max() <= tolerance * deepest
            and gap.min() >= -tolerance * deepest
        ):
            return pressure
        way = np.where(touching, residual + (square / before if goes_on else 0.0) * way, 0.0)
        before = square
        yielded = response.normal(way)
        curvature = float((yielded * way).sum())
        step = float((residual * way).sum()) / curvature if curvature > 0.0 else 0.0
        found = pressure - step * way
        pressure = np.maximum(found, 0.0)
        entering = (pressure == 0.0) & (gap < 0.0)
        goes_on = not entering.any()
        if not goes_on:
            pressure = np.where(entering, -step * gap, pressure)
        if goes_on and found.min() >= 0.0:
            displacement = displacement - step * yielded
        else:
            displacement = response.normal(pressure)
    rest = max(float(np.abs(residual).max()), -float(gap.min()))
    raise ContactError(
        f"the pressure under an indenter is not found in {MAX_ITERATIONS} iterations; {rest:.2g} "
        f"mm of gap or overlap remain, where {tolerance * deepest:.2g} mm would do",
        hint="Press less deep, or check the indenter's shape for spikes",
    )


def _first(response: GridResponse, overlap: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return a pressure in proportion to the overlap, of least energy, and its displacement."""
    pressure = np.maximum(overlap, 0.0)
    displacement = response.normal(pressure)
    scale = float((pressure * overlap).sum() / (pressure * displacement).sum())
    return scale * pressure, scale * displacement


def contact_area(pressure: FloatArray, pitch: float) -> float:
    """Return the area (mm^2) of a contact with a pressure (rows, columns), more finely than the
    grid's squares.

    The pressure of smooth contacts falls to 0 as the square root of the distance from the rim. Its
    square is therefore extrapolated to 0 beyond the outermost points, along rows and along columns.
    If it does not fall, as at the edge of a flat punch, squares count whole.
    """
    touching = pressure > 0.0
    square = np.pad(pressure, 1) ** 2
    count = float(touching.sum())
    beyond = 0.0
    for axis in (0, 1):
        for way in (1, -1):
            before, after = (np.roll(square, step, axis)[1:-1, 1:-1] for step in (way, -way))
            last = touching & (after == 0.0)
            here = square[1:-1, 1:-1][last]
            fall = before[last] - here
            reach = np.divide(here, fall, out=np.full_like(here, 0.5), where=fall > 0.0)
            beyond += float((np.clip(reach, 0.0, 1.0) - 0.5).sum())
    return (count + 0.5 * beyond) * pitch**2
