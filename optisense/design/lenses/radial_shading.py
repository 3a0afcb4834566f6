"""Shading as a power of the distance from the picture's middle.

With another lens than the one for which its shading was corrected, a sensor's pictures have corners
of another colour than their middle, so each channel may have its own loss.
"""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from optisense.array_types import FloatingArray
from optisense.design.fields import Number
from optisense.design.lenses.film import FilmPlaces
from optisense.design.lenses.shading import LensShading

Falloff = Annotated[Number, Field(ge=0.0, lt=1.0)]


class RadialShading(LensShading):
    """The transmission is a polynomial of the distance from the picture's middle."""

    title: ClassVar[str] = "Radial"

    kind: Literal["radial"] = "radial"
    falloff: Falloff = Field(
        default=0.5, description="share of the light that is lost in the picture's corners"
    )
    red_falloff: Falloff | None = Field(
        default=None, description="share of red light that is lost there, if it is another"
    )
    blue_falloff: Falloff | None = Field(
        default=None, description="share of blue light that is lost there, if it is another"
    )
    power: Annotated[Number, Field(ge=1.0, le=16.0)] = Field(
        default=2.0, description="power of the distance with which the loss grows"
    )

    def transmission(self, places: FilmPlaces) -> FloatingArray:
        """Return the transmission (h, w, 3): 1 in the middle, 1 - falloff in the corners and beyond
        them.
        """
        each = [
            self.falloff if own is None else own
            for own in (self.red_falloff, None, self.blue_falloff)
        ]
        return 1.0 - np.multiply.outer(np.minimum(places.radius, 1.0) ** self.power, np.array(each))
