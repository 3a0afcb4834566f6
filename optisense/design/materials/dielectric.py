"""A transparent material."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from optisense.design.fields import Fraction, Number
from optisense.design.materials.base import Material, Medium
from optisense.design.parts import Role
from optisense.design.reflectance import fresnel_dielectric

Index = Annotated[Number, Field(ge=1.0, le=4.0)]
"""A refractive index."""


class Dielectric(Material):
    """A transparent medium such as silicone or acrylic.

    Light of all colours is refracted by `ior`. `dispersion` is kept as data about the material;
    nothing is computed from it yet.
    """

    title: ClassVar[str] = "Transparent"
    roles: ClassVar[tuple[Role, ...]] = (Role.ELASTOMER, Role.SUPPORT, Role.INTERFACE)

    kind: Literal["dielectric"] = "dielectric"
    ior: Index = Field(
        title="Refractive index",
        description="refractive index, at 589 nm where it depends on wavelength",
        examples=[1.5],
    )
    dispersion: tuple[Index, Index, Index] | None = Field(
        default=None,
        title="Index at R, G, B",
        description="index at R, G, B; not used by the simulation yet",
        examples=[(1.5, 1.5, 1.5)],
    )
    roughness: Fraction = Field(default=0.0, description="GGX alpha of its surface, 0 is smooth")

    def medium(self) -> Medium:
        """Its index and the roughness of its surface."""
        return Medium(self.ior, self.roughness)

    def in_words(self) -> str:
        """Its index, and its roughness where it has one."""
        rough = f", rough {self.roughness:g}" if self.roughness > 0.0 else ""
        return f"index {self.ior:g}{rough}"

    def consequences(self) -> list[str]:
        """What a smooth face reflects, and the limit of total reflection."""
        share = 100 * float(fresnel_dielectric(1.0, self.ior))
        lines = [f"a smooth face reflects {share:.1f} % of light that comes straight from air"]
        limit = critical_angle(self.ior)
        if limit is not None:
            lines.append(f"light inside is wholly reflected beyond {limit:.1f} degrees")
        return lines


def critical_angle(ior: float) -> float | None:
    """Degrees from the normal beyond which light inside is reflected wholly; None for air."""
    return float(np.degrees(np.arcsin(1.0 / ior))) if ior > 1.0 else None
