"""Spectra of LEDs in three channels: the shares of a die's light in each channel."""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from optisense.design.fields import Model, Number
from optisense.design.materials.optical_constants import CHANNEL_WAVELENGTHS

GAUSSIAN_WIDTH = 2.0 * np.sqrt(2.0 * np.log(2.0))
"""Ratio of the full width at half maximum of a Gaussian to its standard deviation."""

NANOMETRES: dict[str, Any] = {"unit": "nm"}


class Spectrum(Model):
    """Light of one die of an LED: a Gaussian over wavelength."""

    wavelength: Annotated[Number, Field(ge=380.0, le=780.0)] = Field(
        description="dominant wavelength by the datasheet, taken as the middle",
        examples=[622.0],
        json_schema_extra=NANOMETRES,
    )
    half_width: Annotated[Number, Field(gt=0.0, le=200.0)] = Field(
        default=20.0,
        description="full width at half maximum, by the datasheet",
        json_schema_extra=NANOMETRES,
    )

    def shares(self) -> NDArray[np.float64]:
        """Return the shares (3,) of the flux in the channels R, G and B; they sum to 1.

        Light between the wavelengths of two channels is shared between them linearly by its
        distance to each; beyond the last it belongs to that channel. The response of a camera's
        pixel at these wavelengths is thereby interpolated linearly.
        """
        offsets = np.linspace(-4.0, 4.0, 2001)
        light = np.exp(-0.5 * offsets**2)
        wavelengths = self.wavelength + offsets * self.half_width / GAUSSIAN_WIDTH
        order = np.argsort(CHANNEL_WAVELENGTHS)
        known = np.array(CHANNEL_WAVELENGTHS)[order]
        parts = np.array([np.interp(wavelengths, known, row) for row in np.eye(3)[order].T])
        return np.asarray((parts * light).sum(axis=1) / light.sum())


class LightSpectra(Model):
    """Spectra of a light's dies. Light of a die without one belongs to its own channel alone."""

    red: Spectrum | None = None
    green: Spectrum | None = None
    blue: Spectrum | None = None

    def spread(self) -> NDArray[np.float64]:
        """Return the shares (3, 3) of each die's light (rows) in R, G and B; rows sum to 1."""
        dies = (self.red, self.green, self.blue)
        return np.array(
            [own if die is None else die.shares() for die, own in zip(dies, np.eye(3), strict=True)]
        )
