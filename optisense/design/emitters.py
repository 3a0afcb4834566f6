"""How a lamp sends out light: a flat area, a measured IES profile, or a spot."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field, PrivateAttr, model_validator

from optisense.design.fields import Model, Number, Positive, RelativePath
from optisense.design.ies import IesProfile, read_ies
from optisense.errors import LibraryError

FloatArray = NDArray[np.float64]
HalfAngle = Annotated[Number, Field(gt=0.0, le=90.0)]


class AreaEmitter(Model):
    """A flat emitting window, such as that of an LED without a lens."""

    kind: Literal["area"] = "area"
    shape: Literal["rectangle", "disc"] = Field(default="disc", description="rectangle; disc")
    size: tuple[Positive, Positive] = Field(
        description="mm, width and height of the window; a disc's diameter twice"
    )
    lambertian: Literal[True] = Field(default=True, description="as bright from all sides")

    @model_validator(mode="after")
    def _disc_is_round(self) -> AreaEmitter:
        if self.shape == "disc" and self.size[0] != self.size[1]:
            raise ValueError("a disc has its diameter twice in size")
        return self

    def relative_intensity(self, polar: ArrayLike, azimuth: ArrayLike = 0.0) -> FloatArray:
        """Radiant intensity over its peak: the cosine (Lambert's law); see `LightModel`."""
        cosine = np.cos(np.radians(np.asarray(polar, dtype=np.float64)))
        return np.maximum(cosine, 0.0) + 0.0 * np.asarray(azimuth)


class IesEmitter(Model):
    """A point that radiates as an IES file says; the file's vertical angle 0 is the light's
    direction, its horizontal angle 0 the light's `up`."""

    kind: Literal["ies"] = "ies"
    file: RelativePath = Field(description="LM-63 file, inside this folder")
    _folder: Path | None = PrivateAttr(default=None)

    def path(self) -> Path:
        """The IES file on disk.

        Raises:
            LibraryError: it is not known which folder the file is in, or it is not in it.
        """
        if self._folder is None:
            raise LibraryError(
                f"the IES file '{self.file}' has no folder",
                hint="Load the design or the library entry that names it from its folder",
            )
        folder = Path(os.path.realpath(self._folder))
        path = Path(os.path.realpath(folder / self.file))
        if not path.is_relative_to(folder):
            raise LibraryError(
                f"the IES file '{self.file}' lies outside its folder", where=str(folder)
            )
        return path

    def intensity_table(self) -> IesProfile:
        """Read the file: luminous intensity (candela) over vertical and horizontal angles.

        Raises:
            LibraryError: the file is missing or malformed.
        """
        return read_ies(self.path())

    def relative_intensity(self, polar: ArrayLike, azimuth: ArrayLike = 0.0) -> FloatArray:
        """Radiant intensity over its peak, linear between the file's angles; see `LightModel`.

        Raises:
            LibraryError: the file is missing or malformed.
        """
        table = self.intensity_table()
        polar, turn = np.broadcast_arrays(np.asarray(polar, np.float64), np.mod(azimuth, 360.0))
        planes = np.array(
            [np.interp(polar, table.vertical_angles, row, 0.0, 0.0) for row in table.candela]
        )
        place = np.interp(turn, table.horizontal_angles, np.arange(len(planes)))
        low = np.minimum(place.astype(int), len(planes) - 2)[None]
        below = np.take_along_axis(planes, low, axis=0)[0]
        above = np.take_along_axis(planes, low + 1, axis=0)[0]
        return np.asarray((below + (place - low[0]) * (above - below)) / table.candela.max())


class SpotEmitter(Model):
    """A point whose light is even up to `beam` and falls to nothing at `cutoff`."""

    kind: Literal["spot"] = "spot"
    cutoff: HalfAngle = Field(description="degrees from the axis where the light ends")
    beam: HalfAngle = Field(description="degrees from the axis up to which it is full")

    @model_validator(mode="after")
    def _beam_inside_cutoff(self) -> SpotEmitter:
        if self.beam > self.cutoff:
            raise ValueError("beam can't be wider than cutoff")
        return self

    def relative_intensity(self, polar: ArrayLike, azimuth: ArrayLike = 0.0) -> FloatArray:
        """Radiant intensity over its peak: a smooth step, 3 t^2 - 2 t^3 with t running from 0 at
        the cut-off to 1 at the beam; see `LightModel`."""
        angle = np.asarray(polar, dtype=np.float64)
        if self.cutoff > self.beam:
            t = np.clip((self.cutoff - angle) / (self.cutoff - self.beam), 0.0, 1.0)
        else:
            t = (angle <= self.cutoff).astype(np.float64)
        return t * t * (3.0 - 2.0 * t) + 0.0 * np.asarray(azimuth)


LightModel = Annotated[AreaEmitter | IesEmitter | SpotEmitter, Field(discriminator="kind")]
"""Any kind of lamp; `kind` tells which.

Each has `relative_intensity(polar, azimuth)`: its radiant intensity over the largest one, for
angles in degrees (polar from the light's direction, 0 to 180; azimuth about it), of any shape.
"""
