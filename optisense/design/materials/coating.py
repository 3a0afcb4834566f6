"""Paint with metal flake: the coating of the OptiSense paper."""

from __future__ import annotations

from typing import ClassVar, Literal

from pydantic import Field

from optisense.design.fields import Colour, Fraction, Name, NonNegativeRGB, PositiveRGB
from optisense.design.materials.base import CoatingModel, Reflection

SMALLEST_ROUGHNESS = 0.05
"""GGX alpha of a coating of specularity 1."""


class Coating(CoatingModel):
    """The opaque coating of the sensing surface: from diffuse paint to mirror-like metal flake.

    Seven numbers as in the OptiSense paper (section "Optical material"): reflectance of R, G, B,
    a complex index of R, G, B, and one specularity. How specularity turns into a scattering law
    is written at `specularity_to_roughness`. A file need not name this kind.
    """

    title: ClassVar[str] = "Paint with metal flake"

    kind: Literal["flake"] = Field(default="flake", exclude=True)
    library: Name | None = Field(default=None, description="the library coating it started from")
    reflectance: Colour = Field(description="diffuse reflectance of R, G, B, 0 to 1")
    eta: PositiveRGB = Field(
        title="Index, real",
        description="metal flake: real part of the index at R, G, B",
        examples=[(1.0, 1.0, 1.0)],
    )
    k: NonNegativeRGB = Field(
        title="Index, imaginary",
        description="metal flake: imaginary part of the index at R, G, B",
        examples=[(0.0, 0.0, 0.0)],
    )
    specularity: Fraction = Field(description="0 is diffuse, 1 is mirror-like")

    def reflection(self) -> Reflection:
        """A blend of paint and flake, by specularity."""
        return Reflection(
            self.reflectance,
            self.specularity,
            specularity_to_roughness(self.specularity),
            self.eta,
            self.k,
        )

    def in_words(self) -> str:
        """Its specularity."""
        return f"specularity {self.specularity:g}"

    def consequences(self) -> list[str]:
        """The shares of paint and flake."""
        alpha = specularity_to_roughness(self.specularity)
        return [
            f"{100 * (1 - self.specularity):.0f} % diffuse paint and "
            f"{100 * self.specularity:.0f} % metal flake of roughness {alpha:.2g}"
        ]


def specularity_to_roughness(specularity: float) -> float:
    """GGX alpha of the metal-flake lobe of a coating with this specularity (0..1).

    An assumption: the OptiSense paper varies one specularity of a rough conductor from 0 to 1
    but does not say how it maps to a roughness. Here alpha = max(0.05, 1 - s), and the coating is
    a blend: weight (1 - s) of a diffuse lobe with the coating's reflectance, plus weight s of a
    rough conductor (GGX, this alpha, the coating's eta and k). So 0 is plain diffuse paint and 1
    is nearly a mirror, and energy is conserved in between.

    Raises:
        ValueError: specularity is not within 0..1.
    """
    if not 0.0 <= specularity <= 1.0:
        raise ValueError(f"specularity is {specularity}, it must be within 0..1")
    return max(SMALLEST_ROUGHNESS, 1.0 - specularity)
