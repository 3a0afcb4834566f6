"""Lamp with a measured intensity: a profile in an IES file."""

from __future__ import annotations

from typing import ClassVar, Literal

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field

from optisense.array_types import FloatArray
from optisense.design.emitters._intensity import Intensity
from optisense.design.emitters.base import LightModel
from optisense.design.fields import RelativePath
from optisense.design.ies import IesProfile, read_ies


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
        """Return the file's own table.

        Raises:
            LibraryError: the file is missing or malformed.
        """
        table = self.intensity_table()
        whole = Intensity(table.vertical_angles, table.horizontal_angles, table.candela)
        return whole.without_azimuth()

    def relative_intensity(self, polar: ArrayLike, azimuth: ArrayLike = 0.0) -> FloatArray:
        """Return the radiant intensity over its peak, linear between the file's angles.

        Args:
            polar: angle (...) from the light's direction, degrees.
            azimuth: angle about it, degrees, of a shape that broadcasts with `polar`.

        Raises:
            LibraryError: the file is missing or malformed.
        """
        table = self.intensity()
        polar, turn = np.broadcast_arrays(np.asarray(polar, np.float64), np.mod(azimuth, 360.0))
        return np.asarray(table.at(polar, turn) / table.values.max())

    def in_words(self) -> str:
        """Return the half angle of its intensity as text."""
        return f"IES, half at {self.half_angle():.3g} degrees"
