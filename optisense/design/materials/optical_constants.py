"""Index and absorption of clear materials at the wavelengths of the three channels."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from optisense.array_types import FloatArray
from optisense.design.reflectance import fresnel_dielectric

CHANNEL_WAVELENGTHS = (630.0, 528.0, 465.0)
"""Wavelengths in vacuum at which R, G and B are simulated, nm, near the dominant wavelengths of
common red, green and blue LEDs. Metals of the library are given at the same ones."""

SODIUM_LINE = 589.3
"""Wavelength of the yellow sodium line, nm, at which refractive indices are stated."""


def sellmeier_index(b: Sequence[float], c: Sequence[float], wavelength: object) -> FloatArray:
    """Return the refractive index by Sellmeier's formula, n^2 = 1 + sum of B L^2 / (L^2 - C).

    Args:
        b: coefficients B of the terms.
        c: coefficients C of the terms, in square micrometres.
        wavelength: wavelength, nm, of any shape.

    Returns:
        The index; NaN where the formula has no real solution.
    """
    square = (np.asarray(wavelength, dtype=np.float64) / 1000.0) ** 2
    terms = [one * square / (square - other) for one, other in zip(b, c, strict=True) if one]
    with np.errstate(invalid="ignore"):
        return np.asarray(np.sqrt(1.0 + np.sum(terms, axis=0)))


def cauchy_index(coefficients: Sequence[float], wavelength: object) -> FloatArray:
    """Return the refractive index by Cauchy's formula, n = A + B / L^2 + C / L^4.

    Args:
        coefficients: A, B in square micrometres, C in micrometres to the fourth.
        wavelength: wavelength, nm, of any shape.
    """
    square = (np.asarray(wavelength, dtype=np.float64) / 1000.0) ** 2
    powers = [value / square**power for power, value in enumerate(coefficients)]
    return np.asarray(np.sum(powers, axis=0))


def absorption_of_extinction(k: Sequence[float]) -> FloatArray:
    """Return the absorption coefficient 4 pi k / wavelength at R, G, B, (3,), 1/mm.

    Args:
        k: imaginary part of the refractive index at R, G, B.
    """
    return np.asarray(4.0 * np.pi * np.asarray(k) / (np.array(CHANNEL_WAVELENGTHS) * 1e-6))


def absorption_of_plate(
    transmittance: Sequence[float], thickness: float, index: Sequence[float]
) -> FloatArray:
    """Return the absorption coefficient (3,), 1/mm, of a plate with a measured transmittance.

    Light meets the polished plate at normal incidence in air. Each face reflects R = ((n - 1) /
    (n + 1))^2 of the light inside, repeatedly: T = (1 - R)^2 a / (1 - R^2 a^2), where a is the
    share that is left after one passage. The formula is solved for a.

    Args:
        transmittance: transmittance of the plate at R, G, B, above 0.
        thickness: thickness of the plate, mm.
        index: refractive index at R, G, B.

    Returns:
        The coefficient; negative if the plate transmits more than its faces let through.
    """
    passed = np.asarray(transmittance, dtype=np.float64)
    reflected = fresnel_dielectric(1.0, np.asarray(index, dtype=np.float64))
    half = (1.0 - reflected) ** 2 / 2.0
    # R^2 T a^2 + (1 - R)^2 a - T = 0, in the form that also holds for R = 0.
    left = passed / (half + np.sqrt(half**2 + (reflected * passed) ** 2))
    return np.asarray(-np.log(left) / thickness)
