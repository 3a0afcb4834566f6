"""Detection of a ball's contact in the difference between a photograph and the background.

The response of a tactile sensor to a tilt of its skin is nearly antisymmetric: the brightness that
one flank of a ball loses is gained by the opposite flank. So the contact's middle is the point
about which the difference is most nearly antisymmetric. Inside the contact the skin's tilt, and
with it the response, grows in proportion to the distance from the middle; outside it falls off at
once. So the strength of the response peaks at the contact's edge, and blur moves the peak inward
and the steepest fall outward by about the same distance; the radius is taken half-way between the
two.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import (
    binary_closing,
    binary_fill_holes,
    gaussian_filter,
    label,
    map_coordinates,
    sum_labels,
)
from scipy.optimize import minimize

from optisense.array_types import FloatArray

BLUR = 0.005
"""Standard deviation of the blur of the difference, as a share of the picture's width: 1.6 pixels
of 320, which removes most of the noise of single pixels and hardly widens a contact.
"""

STRONG = 0.35
"""Share of the strongest response from which on pixels belong to the first guess of a contact: the
response grows from the middle of a contact to its edge, so that a third leaves out its middle only.
"""

STRONGEST = 99.7
"""Percentile of the pixels' responses that is taken as the strongest, as single pixels are noisy:
it leaves out 230 pixels of 320 x 240.
"""

ABOVE_NOISE = 6.0
"""Smallest ratio of the strongest response to the median for a contact to be accepted. Noise alone
gives 2.4 at this percentile."""

REACH = 1.2
"""Radius within which the antisymmetry is evaluated, in radii of the first guess: the contact and
its edge, where the response is strongest."""

SIDE = 24
"""Number of points from the middle to the border of the grid on which antisymmetry is evaluated:
about one for each pixel of a usual contact."""

FARTHEST = 3.0
"""Largest radius at which the edge of the contact is searched, in radii of the first guess, beyond
which a press changes nothing."""

LABEL_RANGE = 0.75, 1.3
"""Range in which the edge of a labelled contact is searched, in radii of the label. Labels by hand
are off by a tenth; a stronger response farther away has another cause, or the label is wrong.
"""

BESIDE = 2.2
"""Radius within which the skin moves with a contact, in radii of the contact: beyond it, a response
is noise (see `gauss_newton.NEAR`)."""

AS_STRONG = 0.3
"""Smallest response of a second contact, as a share of the strongest response of a picture: a ball
that was pressed in for the background gives a response of the same order."""

LEAST_RADIUS = 2.0
"""Smallest radius of a contact, in pixels; dust on the gel or the lens makes smaller spots."""


@dataclass(frozen=True)
class FoundContact:
    """Contact found in a photograph.

    Attributes:
        centre: column and row of its middle, pixels from the left and top edge of the picture.
        radius: radius, pixels.
        asymmetry: ratio of the energy of the difference's even part about the middle to that of its
            odd part; 0.05 to 0.2 in photographs of balls, about 1 where there is no contact.
    """

    centre: tuple[float, float]
    radius: float
    asymmetry: float


def find_contact(
    picture: NDArray[np.uint8],
    background: NDArray[np.uint8],
    near: tuple[float, float] | None = None,
    radius: float | None = None,
) -> FoundContact | None:
    """Return the contact in a photograph (h, w, 3) of a pressed ball, or None if no response stands
    out from the noise of its difference from the background.

    It is searched near a first guess of column, row and radius in pixels, such as a label, or else
    where the response is strongest.
    """
    return _contact_in(difference(picture, background), near, radius)


def find_another(
    picture: NDArray[np.uint8], background: NDArray[np.uint8], known: FoundContact
) -> FoundContact | None:
    """Return a second contact in a photograph (h, w, 3), beside a known one, or None if there is
    none as strong.

    Two contacts in each of several photographs mean that the background shows one of them.
    """
    response = difference(picture, background)
    rows, columns = np.mgrid[: response.shape[0], : response.shape[1]] + 0.5
    away = np.hypot(columns - known.centre[0], rows - known.centre[1])
    strongest = np.percentile(np.abs(response), STRONGEST)
    response[away < BESIDE * known.radius] = 0.0
    if np.percentile(np.abs(response), STRONGEST) < AS_STRONG * strongest:
        return None
    return _contact_in(response)


def _contact_in(
    response: FloatArray, near: tuple[float, float] | None = None, radius: float | None = None
) -> FoundContact | None:
    strength = np.sqrt((response**2).sum(axis=2))
    noise = float(np.median(strength))
    peak = float(np.percentile(strength, STRONGEST))
    if not peak > ABOVE_NOISE * max(noise, 0.1):
        return None
    start, size = _first_guess(strength, max(4.0 * noise, STRONG * peak))
    start = start if near is None else (near[0] - 0.5, near[1] - 0.5)
    size = size if radius is None else radius
    if size < LEAST_RADIUS:
        return None
    (column, row), asymmetry = _antisymmetric_point(response, start, size)
    reach = (0.0, FARTHEST) if radius is None else LABEL_RANGE
    found = _edge(strength, column, row, (reach[0] * size, reach[1] * size))
    return FoundContact((column + 0.5, row + 0.5), found, asymmetry)


def difference(picture: NDArray[np.uint8], background: NDArray[np.uint8]) -> FloatArray:
    """Return a photograph minus the background, blurred, minus its median, (h, w, 3) levels."""
    found = picture.astype(np.float64) - background
    width = BLUR * picture.shape[1]
    blurred = gaussian_filter(found, (width, width, 0.0))
    return np.asarray(blurred - np.median(blurred, axis=(0, 1)))


def _first_guess(strength: FloatArray, least: float) -> tuple[tuple[float, float], float]:
    """Return column and row (of pixel centres) and radius of the spot with the most energy."""
    spots, count = label(binary_closing(strength > least, iterations=3))
    if count == 0:
        return (0.0, 0.0), 0.0
    energy = sum_labels(strength**2, spots, np.arange(1, count + 1))
    spot = spots == 1 + int(np.argmax(energy))
    weight = np.where(spot, strength**2, 0.0)
    rows, columns = np.mgrid[: strength.shape[0], : strength.shape[1]]
    total = float(weight.sum())
    middle = float((weight * columns).sum() / total), float((weight * rows).sum() / total)
    return middle, float(np.sqrt(binary_fill_holes(spot).sum() / np.pi))


def _antisymmetric_point(
    response: FloatArray, start: tuple[float, float], radius: float
) -> tuple[tuple[float, float], float]:
    """Return the point of the most nearly antisymmetric response, and its asymmetry there."""
    steps = np.linspace(-REACH, REACH, 2 * SIDE + 1)
    x, y = np.meshgrid(steps, steps)
    half = (np.hypot(x, y) < REACH) & ((y > 0.0) | ((y == 0.0) & (x > 0.0)))
    x, y = radius * x[half], radius * y[half]

    def at(columns: FloatArray, rows: FloatArray) -> FloatArray:
        places = [rows, columns]
        return np.stack(
            [map_coordinates(response[..., c], places, order=1, mode="nearest") for c in range(3)]
        )

    def asymmetry(place: FloatArray) -> float:
        one = at(place[0] + x, place[1] + y)
        other = at(place[0] - x, place[1] - y)
        odd = float(((one - other) ** 2).sum())
        return float(((one + other) ** 2).sum()) / max(odd, 1e-9)

    corner = np.array(start)
    step = 0.15 * radius
    simplex = np.array([corner, corner + (step, 0.0), corner + (0.0, step)])
    found = minimize(
        asymmetry,
        corner,
        method="Nelder-Mead",
        options={"xatol": 0.05, "fatol": 1e-5, "initial_simplex": simplex},
    )
    return (float(found.x[0]), float(found.x[1])), float(found.fun)


def _edge(strength: FloatArray, column: float, row: float, reach: tuple[float, float]) -> float:
    """Return the radius, pixels, between the response's peak and its steepest fall, in `reach`."""
    rows, columns = np.mgrid[: strength.shape[0], : strength.shape[1]]
    distance = np.hypot(columns - column, rows - row)
    rings = np.round(distance).astype(np.int64).ravel()
    count = np.bincount(rings)
    profile = np.bincount(rings, strength.ravel()) / np.maximum(count, 1)
    first, last = int(reach[0]), max(int(reach[1]) + 1, int(reach[0]) + 3)
    profile = profile[:last]
    peak = first + int(np.argmax(profile[first:]))
    fall = -np.gradient(profile)
    steepest = peak + int(np.argmax(fall[peak:]))
    found = 0.5 * (_between(profile, peak) + _between(fall, steepest))
    return min(max(found, reach[0]), reach[1])


def _between(values: FloatArray, top: int) -> float:
    """Return the position of the peak of the parabola through a maximum and its neighbours."""
    if not 0 < top < len(values) - 1:
        return float(top)
    left, middle, right = values[top - 1 : top + 2]
    bend = left - 2.0 * middle + right
    return float(top if bend >= 0.0 else top + 0.5 * (left - right) / bend)
