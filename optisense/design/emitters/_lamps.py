"""The kinds of lamps of this package: a flat window, an IES profile and a spot."""

from __future__ import annotations

from typing import ClassVar, Literal

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field, model_validator

from optisense.array_types import FloatArray
from optisense.design.emitters.base import HalfAngle, Intensity, LightModel, Window
from optisense.design.fields import MILLIMETRES, Positive, RelativePath
from optisense.design.ies import IesProfile, read_ies

FALL_ANGLES = 65
"""Number of polar angles of the table between the beam and the cut-off, where the intensity is a
cubic: linear interpolation between them is off by less than 1e-4 of the peak."""


class AreaEmitter(LightModel):
    """A flat emitting window, such as that of an LED without a lens."""

    title: ClassVar[str] = "Flat window"

    kind: Literal["area"] = "area"
    shape: Literal["rectangle", "disc"] = Field(
        default="disc", title="Window", description="rectangle; disc"
    )
    size: tuple[Positive, Positive] = Field(
        description="mm, width and height of the window; a disc's diameter twice",
        examples=[(2.0, 2.0)],
        json_schema_extra=MILLIMETRES,
    )
    lambertian: Literal[True] = Field(default=True, description="equal radiance in all directions")

    @model_validator(mode="after")
    def _disc_is_round(self) -> AreaEmitter:
        if self.shape == "disc" and self.size[0] != self.size[1]:
            raise ValueError("a disc has its diameter twice in size")
        return self

    def relative_intensity(self, polar: ArrayLike, azimuth: ArrayLike = 0.0) -> FloatArray:
        """Return the cosine (Lambert's law); see `LightModel.relative_intensity`."""
        cosine = np.cos(np.radians(np.asarray(polar, dtype=np.float64)))
        return np.maximum(cosine, 0.0) + 0.0 * np.asarray(azimuth)

    def cosine_power(self) -> float:
        """Return 1: Lambert's law."""
        return 1.0

    def window(self) -> Window:
        """Return the window."""
        return Window(self.shape, self.size)

    def in_words(self) -> str:
        """Return its shape and size as text."""
        width, height = self.size
        size = f"{width:g}" if self.shape == "disc" else f"{width:g} x {height:g}"
        return f"{self.shape} {size} mm"


class IesEmitter(LightModel):
    """A point that radiates as an IES file says; the file's vertical angle 0 is the light's
    direction, its horizontal angle the azimuth: 0 at the light's `up`, and right-handed about the
    direction."""

    title: ClassVar[str] = "IES profile"

    kind: Literal["ies"] = "ies"
    file: RelativePath = Field(title="IES file", description="LM-63 file, inside this folder")

    def intensity_table(self) -> IesProfile:
        """Read the file: luminous intensity (candela) over vertical and horizontal angles.

        Raises:
            LibraryError: the file is missing or malformed.
        """
        return read_ies(self.path("file"))

    def intensity(self) -> Intensity:
        """Return the file's own table; see `LightModel.intensity`."""
        table = self.intensity_table()
        whole = Intensity(table.vertical_angles, table.horizontal_angles, table.candela)
        return whole.without_azimuth()

    def relative_intensity(self, polar: ArrayLike, azimuth: ArrayLike = 0.0) -> FloatArray:
        """Return the intensity, linear between the file's angles; see `LightModel`."""
        table = self.intensity()
        polar, turn = np.broadcast_arrays(np.asarray(polar, np.float64), np.mod(azimuth, 360.0))
        return np.asarray(table.at(polar, turn) / table.values.max())

    def in_words(self) -> str:
        """Return the half angle of its intensity as text."""
        return f"IES, half at {self.half_angle():.3g} degrees"


class SpotEmitter(LightModel):
    """A point whose intensity is constant up to `beam` and falls to 0 at `cutoff`."""

    title: ClassVar[str] = "Spot"

    kind: Literal["spot"] = "spot"
    cutoff: HalfAngle = Field(
        title="Cut-off", description="degrees from the axis where the light ends", examples=[45.0]
    )
    beam: HalfAngle = Field(
        description="degrees from the axis up to which it is full", examples=[30.0]
    )

    @model_validator(mode="after")
    def _beam_inside_cutoff(self) -> SpotEmitter:
        if self.beam > self.cutoff:
            raise ValueError("beam can't be wider than cutoff")
        return self

    def relative_intensity(self, polar: ArrayLike, azimuth: ArrayLike = 0.0) -> FloatArray:
        """Return a smooth step, 3 t^2 - 2 t^3, with t from 0 at the cut-off to 1 at the beam; see
        `LightModel.relative_intensity`.
        """
        angle = np.asarray(polar, dtype=np.float64)
        if self.cutoff > self.beam:
            t = np.clip((self.cutoff - angle) / (self.cutoff - self.beam), 0.0, 1.0)
        else:
            t = (angle <= self.cutoff).astype(np.float64)
        return t * t * (3.0 - 2.0 * t) + 0.0 * np.asarray(azimuth)

    def angles(self) -> tuple[FloatArray, FloatArray]:
        """Return polar angles (n,), degrees, on the axis and from the beam to the cut-off.

        The azimuths are 0 alone, (1,), since a spot is symmetric.
        """
        fall = np.linspace(self.beam, self.cutoff, FALL_ANGLES)
        return np.unique(np.concatenate([[0.0, self.beam], fall])), np.zeros(1)

    def in_words(self) -> str:
        """Return its angles as text."""
        return f"spot, {self.beam:g} to {self.cutoff:g} degrees"
