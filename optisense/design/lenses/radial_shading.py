"""Shading as a power of the distance from the picture's middle."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from optisense.design.fields import Number
from optisense.design.lenses.film import FilmPlaces
from optisense.design.lenses.shading import LensShading

FloatArray = NDArray[np.floating]


class RadialShading(LensShading):
    """The transmission is a polynomial of the distance from the picture's middle."""

    title: ClassVar[str] = "Radial"

    kind: Literal["radial"] = "radial"
    falloff: Annotated[Number, Field(ge=0.0, lt=1.0)] = Field(
        default=0.5, description="share of the light that is lost in the picture's corners"
    )
    power: Annotated[Number, Field(ge=1.0, le=16.0)] = Field(
        default=2.0, description="power of the distance with which the loss grows"
    )

    def transmission(self, places: FilmPlaces) -> FloatArray:
        """Return the transmission: 1 in the middle, 1 - falloff in the corners."""
        share = 1.0 - self.falloff * places.radius**self.power
        return np.repeat(share[..., None], 3, axis=-1)
