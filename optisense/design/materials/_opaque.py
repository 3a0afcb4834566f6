"""Opaque materials: metals, matt and black surfaces."""

from __future__ import annotations

from typing import ClassVar, Literal

from pydantic import Field

from optisense.design.fields import Colour, Fraction, NonNegativeRGB, PositiveRGB
from optisense.design.materials.base import Material, Reflection
from optisense.design.parts import Role


class Conductor(Material):
    """A metal surface such as a mirror."""

    title: ClassVar[str] = "Metal"

    kind: Literal["conductor"] = "conductor"
    eta: PositiveRGB = Field(
        title="Index, real",
        description="real part of the refractive index at R, G, B",
        examples=[(1.0, 1.0, 1.0)],
    )
    k: NonNegativeRGB = Field(
        title="Index, imaginary",
        description="imaginary part of the refractive index at R, G, B",
        examples=[(0.0, 0.0, 0.0)],
    )
    roughness: Fraction = Field(default=0.0, description="GGX alpha, 0 is a perfect mirror")

    def reflection(self) -> Reflection:
        """Return the reflection of the metal alone."""
        return Reflection(specularity=1.0, roughness=self.roughness, eta=self.eta, k=self.k)

    def in_words(self) -> str:
        """Return its reflectance at normal incidence, as text."""
        return f"reflects {100 * float(self.reflection().normal_reflectance().mean()):.0f} %"

    def consequences(self) -> list[str]:
        """Return its reflectance in each colour, one per line."""
        share = 100 * self.reflection().normal_reflectance()
        return ["reflects {:.1f}, {:.1f}, {:.1f} % of R, G, B in air".format(*share)]


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


class Absorber(Material):
    """An opaque surface that absorbs all light."""

    title: ClassVar[str] = "Absorber"
    roles: ClassVar[tuple[Role, ...]] = (Role.BLOCKER, Role.INDENTER)

    kind: Literal["absorber"] = "absorber"

    def in_words(self) -> str:
        """Return the text that the material is black."""
        return "reflects nothing"
