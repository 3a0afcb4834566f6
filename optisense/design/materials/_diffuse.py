"""A matt surface."""

from __future__ import annotations

from typing import ClassVar, Literal

from pydantic import Field

from optisense.design.fields import Colour
from optisense.design.materials.base import Material, Reflection


class Diffuse(Material):
    """An opaque Lambertian surface."""

    title: ClassVar[str] = "Diffuse"

    kind: Literal["diffuse"] = "diffuse"
    reflectance: Colour = Field(
        description="reflectance at R, G, B, 0 to 1", examples=[(0.5, 0.5, 0.5)]
    )

    def reflection(self) -> Reflection:
        """Return the reflection of the diffuse lobe alone."""
        return Reflection(reflectance=self.reflectance)
