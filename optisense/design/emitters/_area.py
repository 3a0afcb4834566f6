"""A flat emitting window."""

from __future__ import annotations

from typing import ClassVar, Literal

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field, model_validator

from optisense.array_types import FloatArray
from optisense.design.emitters.base import LightModel, Window
from optisense.design.fields import MILLIMETRES, Positive


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
        """Return the radiant intensity over its peak: the cosine (Lambert's law).

        Args:
            polar: angle (...) from the light's direction, degrees.
            azimuth: angle about it, degrees, of a shape that broadcasts with `polar`.
        """
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
