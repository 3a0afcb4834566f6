"""Index and absorption of clear materials at the wavelengths of the three channels."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from optisense.design.reflectance import fresnel_dielectric

CHANNEL_WAVELENGTHS = (630.0, 528.0, 465.0)
"""nm, in vacuum: the wavelengths at which R, G and B are simulated, near the dominant wavelengths
of the usual red, green and blue LEDs. Metals of the library are given at the same ones."""

SODIUM_LINE = 589.3
"""nm: the yellow line of sodium, at which a refractive index is stated where nothing else is
said."""

Array = NDArray[np.float64]


def sellmeier_index(b: Sequence[float], c: Sequence[float], wavelength: object) -> Array:
    """Refractive index by Sellmeier's formula, n^2 = 1 + sum of B L^2 / (L^2 - C).

    Args:
        b: the coefficients B of the terms.
        c: the coefficients C of the terms, in square micrometres.
        wavelength: nm, of any shape.

    Returns:
        The index; NaN where the formula has no real solution.
    """
    square = (np.asarray(wavelength, dtype=np.float64) / 1000.0) ** 2
    terms = [one * square / (square - other) for one, other in zip(b, c, strict=True) if one]
    with np.errstate(invalid="ignore"):
        return np.asarray(np.sqrt(1.0 + np.sum(terms, axis=0)))


def cauchy_index(coefficients: Sequence[float], wavelength: object) -> Array:
    """Refractive index by Cauchy's formula, n = A + B / L^2 + C / L^4.

    Args:
        coefficients: A, B in square micrometres, C in micrometres to the fourth.
        wavelength: nm, of any shape.
    """
    square = (np.asarray(wavelength, dtype=np.float64) / 1000.0) ** 2
    powers = [value / square**power for power, value in enumerate(coefficients)]
    return np.asarray(np.sum(powers, axis=0))


def absorption_of_extinction(k: Sequence[float]) -> Array:
    """(3,) per mm: the absorption coefficient 4 pi k / wavelength at R, G, B.

    Args:
        k: the imaginary part of the refractive index at R, G, B.
    """
    return np.asarray(4.0 * np.pi * np.asarray(k) / (np.array(CHANNEL_WAVELENGTHS) * 1e-6))


def absorption_of_plate(
    transmittance: Sequence[float], thickness: float, index: Sequence[float]
) -> Array:
    """(3,) per mm: the absorption coefficient of a plate of which the transmittance was measured.

    Light meets the polished plate at right angles in air. Of the light inside, each face reflects
    R = ((n - 1) / (n + 1))^2, again and again: T = (1 - R)^2 a / (1 - R^2 a^2), where a is the
    share that is left after one passage. The formula is solved for a.

    Args:
        transmittance: of the plate at R, G, B, above 0.
        thickness: mm.
        index: refractive index at R, G, B.

    Returns:
        The coefficient; negative where the plate passes more than its faces let through.
    """
    passed = np.asarray(transmittance, dtype=np.float64)
    reflected = fresnel_dielectric(1.0, np.asarray(index, dtype=np.float64))
    half = (1.0 - reflected) ** 2 / 2.0
    # R^2 T a^2 + (1 - R)^2 a - T = 0, in the form that also holds where R is 0.
    left = passed / (half + np.sqrt(half**2 + (reflected * passed) ** 2))
    return np.asarray(-np.log(left) / thickness)
