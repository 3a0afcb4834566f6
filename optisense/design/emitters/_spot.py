"""Spot lamp."""

from __future__ import annotations

from typing import ClassVar, Literal

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field, model_validator

from optisense.array_types import FloatArray
from optisense.design.emitters.base import HalfAngle, LightModel

FALL_ANGLES = 65
"""Number of polar angles of the table between the beam and the cut-off, where the intensity is a
cubic: linear interpolation between them is off by less than 1e-4 of the peak.
"""


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
        """Return the radiant intensity over its peak.

        It is a smooth step, 3 t^2 - 2 t^3, with t from 0 at the cut-off to 1 at the beam.

        Args:
            polar: angle (...) from the light's direction, degrees.
            azimuth: angle about it, degrees, of a shape that broadcasts with `polar`.
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
