"""Spectra of LEDs in three channels: how much of a red LED is light of other channels."""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from optisense.design.fields import Model, Number
from optisense.design.materials.optical_constants import CHANNEL_WAVELENGTHS

GAUSSIAN_WIDTH = 2.0 * np.sqrt(2.0 * np.log(2.0))
"""Full width at half maximum of a Gaussian over its standard deviation."""

NANOMETRES: dict[str, Any] = {"unit": "nm"}


class Spectrum(Model):
    """The light of one die of an LED: a Gaussian over wavelength."""

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
        """(3,) the shares of the flux that count as light of R, G and B; they sum to 1.

        Light between the wavelengths of two channels is shared between them linearly, by how near
        it is to each; beyond the last, it is of that channel. What a camera's pixel sees of it, by
        its response at these wavelengths, is then interpolated between them.
        """
        offsets = np.linspace(-4.0, 4.0, 2001)
        light = np.exp(-0.5 * offsets**2)
        wavelengths = self.wavelength + offsets * self.half_width / GAUSSIAN_WIDTH
        order = np.argsort(CHANNEL_WAVELENGTHS)
        known = np.array(CHANNEL_WAVELENGTHS)[order]
        parts = np.array([np.interp(wavelengths, known, row) for row in np.eye(3)[order].T])
        return np.asarray((parts * light).sum(axis=1) / light.sum())


class LightSpectra(Model):
    """The spectra of a light's dies. Light of a die without one is of its own channel alone."""

    red: Spectrum | None = None
    green: Spectrum | None = None
    blue: Spectrum | None = None

    def spread(self) -> NDArray[np.float64]:
        """(3, 3): in each row, how the light of the red, green or blue die is shared among R, G
        and B; rows sum to 1."""
        dies = (self.red, self.green, self.blue)
        return np.array(
            [own if die is None else die.shares() for die, own in zip(dies, np.eye(3), strict=True)]
        )
