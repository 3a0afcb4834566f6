"""A transparent material."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field, model_validator

from optisense.design.fields import (
    MILLIMETRES,
    Colour,
    Fraction,
    InconsistentValueError,
    Model,
    NonNegative,
    NonNegativeRGB,
    Number,
    Positive,
    is_left_out,
)
from optisense.design.materials.base import RGB, Material, Medium
from optisense.design.materials.optical_constants import (
    CHANNEL_WAVELENGTHS,
    SODIUM_LINE,
    absorption_of_extinction,
    absorption_of_plate,
    cauchy_index,
    sellmeier_index,
)
from optisense.design.parts import Role
from optisense.design.reflectance import fresnel_dielectric

Index = Annotated[Number, Field(ge=1.0, le=4.0)]
"""Refractive index of a transparent material."""

PER_MM: dict[str, Any] = {"unit": "1/mm"}

INDEX_AGREEMENT = 0.02
"""Largest difference between `ior` and a formula of the index at 589 nm. The literature's indices
of one silicone differ by as much as 0.04, and errors of a digit or a unit by far more."""

ROUNDING = 1e-9
"""Largest absorption coefficient, 1/mm, that a plate's transmittance can give by rounding alone."""

ABSORPTIONS = ("absorption", "extinction", "transmittance")
"""Fields that determine the absorption; a material gives at most one of them."""

MAX_POISSON_RATIO = 0.4999
"""Largest Poisson ratio of a material. At 0.5 it would be incompressible and its bulk modulus
infinite; measured values of silicones are 0.48 to 0.4999."""


class GelElasticity(Model):
    """Constants of linear isotropic elasticity of a gel, and its friction."""

    youngs_modulus: Positive = Field(
        description="Young's modulus", examples=[0.435], json_schema_extra={"unit": "MPa"}
    )
    poisson_ratio: Annotated[Number, Field(ge=0.0, le=MAX_POISSON_RATIO)] = Field(
        default=0.49, description="Poisson ratio; near 0.5 for silicones"
    )
    friction: NonNegative = Field(
        default=1.0, description="coefficient of friction of the coated skin"
    )


class Dielectric(Material):
    """A transparent medium such as silicone or acrylic.

    Light of all colours is refracted by `ior`, unless the design asks for dispersion: then by the
    index at R, G and B, from `dispersion` or from Sellmeier's or Cauchy's formula. What is absorbed
    on the way follows from `absorption`, `extinction`, or `transmittance` and `thickness`; without
    them the medium is clear.
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
        description="index at R, G, B (630, 528, 465 nm), used where the design asks for "
        "dispersion",
        examples=[(1.5, 1.5, 1.5)],
    )
    roughness: Fraction = Field(default=0.0, description="GGX alpha of its surface, 0 is smooth")
    absorption: NonNegativeRGB | None = Field(
        default=None,
        exclude_if=is_left_out,
        description="absorption coefficient at R, G, B",
        examples=[(0.0, 0.0, 0.0)],
        json_schema_extra=PER_MM,
    )
    extinction: NonNegativeRGB | None = Field(
        default=None,
        exclude_if=is_left_out,
        title="Index, imaginary",
        description="imaginary part of the index at R, G, B, in place of absorption",
        examples=[(0.0, 0.0, 0.0)],
    )
    transmittance: Colour | None = Field(
        default=None,
        exclude_if=is_left_out,
        title="Plate's transmittance",
        description="measured at R, G, B through a polished plate in air, its reflections "
        "included, in place of absorption",
        examples=[(0.92, 0.92, 0.92)],
    )
    thickness: Positive | None = Field(
        default=None,
        exclude_if=is_left_out,
        title="Plate's thickness",
        description="thickness of that plate",
        examples=[3.0],
        json_schema_extra=MILLIMETRES,
    )
    sellmeier_b: tuple[Number, Number, Number] | None = Field(
        default=None,
        exclude_if=is_left_out,
        title="Sellmeier B",
        description="coefficients B of n^2 = 1 + sum of B L^2 / (L^2 - C); 0 for unused terms",
        examples=[(1.0, 0.0, 0.0)],
    )
    sellmeier_c: tuple[Number, Number, Number] | None = Field(
        default=None,
        exclude_if=is_left_out,
        title="Sellmeier C",
        description="coefficients C of the same terms",
        examples=[(0.01, 0.0, 0.0)],
        json_schema_extra={"unit": "square micrometres"},
    )
    cauchy: tuple[Number, Number, Number] | None = Field(
        default=None,
        exclude_if=is_left_out,
        description="A, B and C of n = A + B / L^2 + C / L^4, L in micrometres",
        examples=[(1.5, 0.004, 0.0)],
    )

    elasticity: GelElasticity | None = Field(
        default=None, description="elastic constants, for elastomers", exclude_if=is_left_out
    )

    @model_validator(mode="after")
    def _check_one_source(self) -> Dielectric:
        ways = [name for name in ABSORPTIONS if getattr(self, name) is not None]
        if len(ways) > 1:
            raise InconsistentValueError(
                f"absorption is given twice, by '{ways[0]}' and by '{ways[1]}'",
                (ways[1],),
                "Keep one of them",
            )
        for one, other in (("transmittance", "thickness"), ("sellmeier_b", "sellmeier_c")):
            for name, partner in ((one, other), (other, one)):
                if getattr(self, name) is not None and getattr(self, partner) is None:
                    raise InconsistentValueError(
                        f"'{name}' needs '{partner}' as well", (name,), "Add it"
                    )
        formulas = ("dispersion", "sellmeier_b", "cauchy")
        given = [name for name in formulas if getattr(self, name) is not None]
        if len(given) > 1:
            raise InconsistentValueError(
                f"the index at R, G, B is given twice, by '{given[0]}' and by '{given[1]}'",
                (given[1],),
                "Keep one of them",
            )
        self._check_index()
        self._check_transmittance()
        return self

    def _check_index(self) -> None:
        if self.sellmeier_b is None and self.cauchy is None:
            return
        name = "cauchy" if self.sellmeier_b is None else "sellmeier_b"
        found = self._index_at(SODIUM_LINE)
        if not abs(found - self.ior) <= INDEX_AGREEMENT:
            raise InconsistentValueError(
                f"'{name}' gives an index of {found:.4g} at 589 nm, and 'ior' is {self.ior:g}",
                (name,),
                "Give wavelengths in micrometres, and the same index in both",
            )
        for wavelength in CHANNEL_WAVELENGTHS:
            if not 1.0 <= self._index_at(wavelength) <= 4.0:
                raise InconsistentValueError(
                    f"'{name}' gives an index of {self._index_at(wavelength):.4g} at "
                    f"{wavelength:g} nm, and it must be 1 to 4",
                    (name,),
                    "Give wavelengths in micrometres",
                )

    def _check_transmittance(self) -> None:
        if self.transmittance is None:
            return
        if min(self.transmittance) <= 0.0:
            raise InconsistentValueError(
                "the absorption does not follow from a plate of transmittance 0",
                ("transmittance",),
                "Measure a thinner plate, or give 'absorption'",
            )
        if min(self.absorption_coefficient()) < 0.0:
            faces = 1.0 - fresnel_dielectric(1.0, np.array(self.channel_indices()))
            clear = ", ".join(f"{value:.3f}" for value in faces / (2.0 - faces))
            raise InconsistentValueError(
                f"the two faces of a plate of index {self.ior:g} alone reflect so much that it "
                f"passes at most {clear} of R, G, B",
                ("transmittance",),
                "Give what was measured in air, reflections included; for a transmittance of the "
                "inside alone give absorption: -ln(T) / thickness",
            )

    def _index_at(self, wavelength: float) -> float:
        if self.sellmeier_b is not None and self.sellmeier_c is not None:
            return float(sellmeier_index(self.sellmeier_b, self.sellmeier_c, wavelength))
        if self.cauchy is not None:
            return float(cauchy_index(self.cauchy, wavelength))
        return self.ior

    def channel_indices(self) -> RGB:
        """Return the refractive index at R, G, B: `ior` for all if nothing else is known."""
        if self.dispersion is not None:
            return self.dispersion
        red, green, blue = (self._index_at(each) for each in CHANNEL_WAVELENGTHS)
        return red, green, blue

    def absorption_coefficient(self) -> RGB:
        """Return the absorption at R, G, B, 1/mm: exp(-absorption d) is left after d mm."""
        found = np.zeros(3)
        if self.absorption is not None:
            found = np.array(self.absorption)
        elif self.extinction is not None:
            found = absorption_of_extinction(self.extinction)
        elif self.transmittance is not None and self.thickness is not None:
            found = absorption_of_plate(self.transmittance, self.thickness, self.channel_indices())
            # By rounding, a plate without absorption may seem to absorb, or to emit light.
            found = np.where(np.abs(found) < ROUNDING, 0.0, found)
        red, green, blue = found.tolist()
        return red, green, blue

    def medium(self) -> Medium:
        """Return its index, the roughness of its surface, and its absorption."""
        indices = self.channel_indices()
        return Medium(
            self.ior,
            self.roughness,
            self.absorption_coefficient(),
            None if indices == (self.ior,) * 3 else indices,
        )

    def in_words(self) -> str:
        """Return its index as text, and its roughness and absorption if it has any."""
        words = f"index {self.ior:g}"
        if self.roughness > 0.0:
            words += f", rough {self.roughness:g}"
        if max(self.absorption_coefficient()) > 0.0:
            words += f", absorbs {max(self.absorption_coefficient()):.2g} /mm"
        return words

    def consequences(self) -> list[str]:
        """Return the reflectance of a smooth face, and the critical angle of total reflection."""
        share = 100 * float(fresnel_dielectric(1.0, self.ior))
        lines = [f"a smooth face reflects {share:.1f} % of light that comes straight from air"]
        limit = critical_angle(self.ior)
        if limit is not None:
            lines.append(f"light inside is wholly reflected beyond {limit:.1f} degrees")
        absorption = np.array(self.absorption_coefficient())
        if absorption.max() > 0.0:
            lost = 100.0 * (1.0 - np.exp(-10.0 * absorption))
            lines.append("10 mm absorb {:.1f}, {:.1f}, {:.1f} % of R, G, B".format(*lost))
        return lines


def critical_angle(ior: float) -> float | None:
    """Return the angle of incidence, degrees, from which light inside stays there; None in air."""
    return float(np.degrees(np.arcsin(1.0 / ior))) if ior > 1.0 else None
