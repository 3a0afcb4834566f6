"""Light groups: lights of one type and colour, each with a pose, and spectra of their LEDs."""

from __future__ import annotations

from functools import lru_cache
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from optisense.array_types import FloatArray
from optisense.design.emitters import LightModel
from optisense.design.fields import (
    Colour,
    Direction,
    Model,
    Name,
    NonNegative,
    Number,
    Vector,
    is_left_out,
)
from optisense.design.materials.optical_constants import CHANNEL_WAVELENGTHS

GAUSSIAN_WIDTH = 2.0 * np.sqrt(2.0 * np.log(2.0))
"""Ratio of the full width at half maximum of a Gaussian to its standard deviation."""

NANOMETRES: dict[str, Any] = {"unit": "nm"}

MOST_LIGHTS = 10_000
"""Largest number of lights of one group; the built-in sensors have at most some dozens, and a pitch
in metres would give more."""


class Light(Model):
    """Pose of one light."""

    position: Vector = Field(description="mm, x y z")
    direction: Direction = Field(description="axis of its beam, any length")
    up: Direction | None = Field(default=None, description="along the height of its window")


class Spectrum(Model):
    """Light of one LED, red, green or blue: a Gaussian over wavelength."""

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
    """Spectra of a light's LEDs. Light of an LED without one belongs to its own channel alone."""

    red: Spectrum | None = None
    green: Spectrum | None = None
    blue: Spectrum | None = None

    def spread(self) -> NDArray[np.float64]:
        """Return the shares (3, 3) of each LED's light (rows) in R, G and B; rows sum to 1."""
        leds = (self.red, self.green, self.blue)
        return np.array(
            [own if led is None else led.shares() for led, own in zip(leds, np.eye(3), strict=True)]
        )


class LightGroup(Model):
    """Lights that are switched and recoloured together."""

    model: Name = Field(description="library light, or a name for the emitter below")
    colour: Colour = Field(description="shares of R, G, B in its flux; only ratios count")
    flux: Annotated[NonNegative, Field(le=1e6)] = Field(
        description="mW, radiant flux of each light, over all channels"
    )
    emitter: LightModel | None = Field(
        default=None, description="emitter, instead of the library's light"
    )
    spectrum: LightSpectra | None = Field(
        default=None,
        exclude_if=is_left_out,
        description="spectra of the red, green and blue LEDs; without them, each LED emits in its "
        "own channel",
    )
    lights: Annotated[list[Light], Field(min_length=1, max_length=MOST_LIGHTS)] = Field(
        description="position in mm, direction of any length"
    )

    @model_validator(mode="after")
    def _has_a_colour(self) -> LightGroup:
        if sum(self.colour) <= 0.0:
            raise ValueError("a colour needs at least one value above 0; use flux: 0 for darkness")
        return self

    def channel_flux(self) -> NDArray[np.float64]:
        """Return the radiant flux of each light in R, G and B, (3,) mW; they sum to `flux`.

        `colour` shares the flux among the LEDs, and `spectrum` the light of each LED among R, G
        and B.
        """
        colour = np.array(self.colour)
        leds = self.flux * colour / colour.sum()
        return np.asarray(leds if self.spectrum is None else leds @ self.spectrum.spread())


def of_model(model: str) -> dict[str, Any]:
    """Return the fields of a light group that another model of its lights changes: an emitter of
    its own describes the lights of the former model.
    """
    return {"model": model, "emitter": None}


@lru_cache(maxsize=4096)
def frame_of(
    direction: tuple[float, float, float], up: tuple[float, float, float] | None
) -> FloatArray:
    """Return the unit vectors (3, 3) of width axis, height axis and direction of a light, as rows.

    The array is shared between calls and must not be changed.
    """
    n = np.asarray(direction, float)
    n = n / np.linalg.norm(n)
    s = np.cross(np.asarray(up if up is not None else (0.0, 0.0, 1.0), float), n)
    if np.linalg.norm(s) < 1e-6:
        s = np.cross((1.0, 0.0, 0.0) if abs(n[0]) < 0.9 else (0.0, 1.0, 0.0), n)
    s = s / np.linalg.norm(s)
    frame = np.stack([s, np.cross(n, s), n])
    frame.flags.writeable = False
    return frame
