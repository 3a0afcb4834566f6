"""Paint with metal flake: the coating of the OptiSense paper."""

from __future__ import annotations

from typing import ClassVar, Literal

from pydantic import Field

from optisense.design.fields import (
    Colour,
    Fraction,
    Name,
    NonNegativeRGB,
    PositiveRGB,
    is_left_out,
)
from optisense.design.materials.base import CoatingModel, Reflection

SMALLEST_ROUGHNESS = 0.05
"""GGX alpha of a coating with specularity 1. Smaller values describe polished mirrors, which no
sprayed or rubbed coating is."""
FIXED_ROUGHNESS = 0.1
"""GGX alpha of the flake if specularity does not change it: the default of Mitsuba's
`roughconductor` (its documentation), as the paper names that model and no roughness."""

Scattering = Literal["blend", "blend-fixed-roughness", "conductor"]
"""Model that the specularity of a coating controls; see `flake_lobe`."""


def _is_usual(scattering: object) -> bool:
    """Return whether it is not written, so that designs of earlier releases are unchanged."""
    return scattering == "blend"


class Coating(CoatingModel):
    """The opaque coating of the sensing surface: from diffuse paint to mirror-like metal flake.

    Seven numbers as in the OptiSense paper (section "Optical material"): reflectance of R, G, B,
    a complex index of R, G, B, and one specularity. How specularity turns into a scattering law
    is a choice, `scattering`, whose formulas are written at `flake_lobe`. A file need not name
    this kind.
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
    scattering: Scattering = Field(
        default="blend",
        exclude_if=_is_usual,
        title="Scattering law",
        description="what specularity changes: paint and flake in a blend; their shares alone; or "
        "the roughness of a bare metal",
    )
    roughness: float | None = Field(
        default=None,
        ge=SMALLEST_ROUGHNESS,
        le=1.0,
        exclude_if=is_left_out,
        description="GGX alpha of the metal flake; follows from the scattering law if left out",
    )

    def reflection(self) -> Reflection:
        """Return a blend of paint and flake, or flake alone, by specularity."""
        share, alpha = self._flake()
        return Reflection(self.reflectance, share, alpha, self.eta, self.k)

    def _flake(self) -> tuple[float, float]:
        """Return share and roughness of the metal flake."""
        share, alpha = flake_lobe(self.specularity, self.scattering)
        return share, alpha if self.roughness is None else self.roughness

    def in_words(self) -> str:
        """Return its specularity as text, with its scattering law if that is not the default."""
        law = "" if _is_usual(self.scattering) else f" ({self.scattering})"
        return f"specularity {self.specularity:g}{law}"

    def consequences(self) -> list[str]:
        """Return the shares of paint and flake."""
        share, alpha = self._flake()
        return [
            f"{100 * (1 - share):.0f} % diffuse paint and "
            f"{100 * share:.0f} % metal flake of roughness {alpha:.2g}"
        ]


def flake_lobe(specularity: float, scattering: Scattering = "blend") -> tuple[float, float]:
    """Return share and roughness of the metal flake of a coating with this specularity.

    The OptiSense paper varies one specularity s, from 0 to 1, of a rough conductor that also has a
    reflectance, and does not state what s changes. With w the weight of the metal's lobe (GGX of
    roughness alpha; the coating's eta and k), and 1 - w that of a diffuse lobe of the coating's
    reflectance, these are the possible readings:

    - `blend`: w = s, alpha = max(0.05, 1 - s)
    - `blend-fixed-roughness`: w = s, alpha = 0.1
    - `conductor`: w = 1, alpha = max(0.05, 1 - s)

    With `conductor` there is no diffuse lobe, and the reflectance is not used. The weights sum to
    1, so that no reading reflects more light than arrives; a rough metal reflects less, as GGX
    leaves out light that meets more than one facet (69 % of it at normal incidence at alpha = 1).

    Args:
        specularity: specularity, 0 to 1.
        scattering: reading of the paper.

    Returns:
        The share of the metal's lobe, 0 to 1, and its GGX alpha.

    Raises:
        ValueError: specularity is not within 0..1, or there is no such reading.
    """
    alpha = specularity_to_roughness(specularity)
    laws = {
        "blend": (specularity, alpha),
        "blend-fixed-roughness": (specularity, FIXED_ROUGHNESS),
        "conductor": (1.0, alpha),
    }
    if scattering not in laws:
        raise ValueError(f"scattering is {scattering!r}, it must be one of {', '.join(laws)}")
    return laws[scattering]


def specularity_to_roughness(specularity: float) -> float:
    """Return the GGX alpha of the metal-flake lobe of a coating with this specularity (0..1).

    It is max(0.05, 1 - s), so that 0 is diffuse and 1 is nearly a mirror: an assumption; see
    `optisense.design.materials.flake_lobe`.

    Raises:
        ValueError: specularity is not within 0..1.
    """
    if not 0.0 <= specularity <= 1.0:
        raise ValueError(f"specularity is {specularity}, it must be within 0..1")
    return max(SMALLEST_ROUGHNESS, 1.0 - specularity)
