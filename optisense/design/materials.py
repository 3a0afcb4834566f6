"""Optical materials of parts, and the coating of the sensing surface."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from optisense.design.fields import (
    Colour,
    Fraction,
    Model,
    Name,
    NonNegativeRGB,
    Number,
    PositiveRGB,
)

Index = Annotated[Number, Field(ge=1.0, le=4.0)]
"""A refractive index."""


class Dielectric(Model):
    """A transparent medium such as silicone or acrylic.

    Light of all colours is refracted by `ior`. `dispersion` is kept as data about the material;
    nothing is computed from it yet.
    """

    kind: Literal["dielectric"] = "dielectric"
    ior: Index = Field(description="refractive index, at 589 nm where it depends on wavelength")
    dispersion: tuple[Index, Index, Index] | None = Field(
        default=None, description="index at R, G, B; not used by the simulation yet"
    )
    roughness: Fraction = Field(default=0.0, description="GGX alpha of its surface, 0 is smooth")


class Conductor(Model):
    """A metal surface such as a mirror."""

    kind: Literal["conductor"] = "conductor"
    eta: PositiveRGB = Field(description="real part of the refractive index at R, G, B")
    k: NonNegativeRGB = Field(description="imaginary part of the refractive index at R, G, B")
    roughness: Fraction = Field(default=0.0, description="GGX alpha, 0 is a perfect mirror")


class Diffuse(Model):
    """An opaque Lambertian surface."""

    kind: Literal["diffuse"] = "diffuse"
    reflectance: Colour = Field(description="of R, G, B, 0 to 1")


class Absorber(Model):
    """An opaque surface that absorbs all light."""

    kind: Literal["absorber"] = "absorber"


Material = Annotated[Dielectric | Conductor | Diffuse | Absorber, Field(discriminator="kind")]
"""Any optical material of a part; `kind` tells which."""


class Coating(Model):
    """The opaque coating of the sensing surface: from diffuse paint to mirror-like metal flake.

    Seven numbers as in the OptiSense paper (section "Optical material"): reflectance of R, G, B,
    a complex index of R, G, B, and one specularity. How specularity turns into a scattering law
    is written at `optisense.library.specularity_to_roughness`.
    """

    library: Name | None = Field(default=None, description="the library coating it started from")
    reflectance: Colour = Field(description="diffuse reflectance of R, G, B, 0 to 1")
    eta: PositiveRGB = Field(description="metal flake: real part of the index at R, G, B")
    k: NonNegativeRGB = Field(description="metal flake: imaginary part of the index at R, G, B")
    specularity: Fraction = Field(description="0 is diffuse, 1 is mirror-like")
