"""The interface of all materials and coatings."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from optisense.design.fields import Name
from optisense.design.kinds import KindModel
from optisense.design.parts import Role
from optisense.design.reflectance import fresnel_metal
from optisense.errors import DesignError
from optisense.registry import Registry

RGB = tuple[float, float, float]

GEL_INDEX = 1.41
"""Refractive index of silicone: a coating is seen from inside the gel."""


@dataclass(frozen=True)
class Medium:
    """The optical medium of a transparent material.

    Attributes:
        ior: refractive index, of all colours where dispersion is not simulated.
        roughness: GGX alpha of its surface; 0 is smooth.
        absorption: coefficient per mm at R, G, B: of light that has travelled d mm, the share
            exp(-absorption d) is left (Beer and Lambert).
        indices: refractive index at R, G, B, for designs that ask for dispersion; None where it is
            not known, and `ior` stands for all.
    """

    ior: float
    roughness: float = 0.0
    absorption: RGB = (0.0, 0.0, 0.0)
    indices: RGB | None = None


@dataclass(frozen=True)
class Reflection:
    """Reflection at an opaque surface: a blend of a diffuse lobe and a rough metal's.

    The weights are 1 - `specularity` and `specularity`. As it stands, the surface is black.

    Attributes:
        reflectance: of the diffuse lobe, for R, G, B, 0 to 1.
        specularity: the metal's share, 0 to 1.
        roughness: GGX alpha of the metal's facets.
        eta, k: the metal's complex refractive index, for R, G, B.
    """

    reflectance: RGB = (0.0, 0.0, 0.0)
    specularity: float = 0.0
    roughness: float = 1.0
    eta: RGB = (1.0, 1.0, 1.0)
    k: RGB = (0.0, 0.0, 0.0)

    @property
    def is_black(self) -> bool:
        """Whether nothing is reflected."""
        return self.specularity == 0.0 and max(self.reflectance) == 0.0

    @property
    def is_metal(self) -> bool:
        """Whether there is no diffuse lobe."""
        return self.specularity == 1.0

    def seen_in(self, ior: float) -> Reflection:
        """The same surface in a medium of this index: the metal's index over it."""
        red, green, blue = (value / ior for value in self.eta)
        k_red, k_green, k_blue = (value / ior for value in self.k)
        return Reflection(
            self.reflectance,
            self.specularity,
            self.roughness,
            (red, green, blue),
            (k_red, k_green, k_blue),
        )

    def head_on(self) -> NDArray[np.float64]:
        """(3,) the share of R, G, B light reflected that meets the surface straight on."""
        metal = fresnel_metal(1.0, self.eta, self.k)
        diffuse = np.array(self.reflectance)
        return np.asarray((1.0 - self.specularity) * diffuse + self.specularity * metal)


class Material(KindModel):
    """The material of a part; each kind of material is a subclass.

    A kind is transparent, and has a `medium`, or opaque, and has a `reflection`.

    Attributes:
        roles: what parts of it can be.
    """

    kinds: ClassVar[Registry[Any]] = Registry(
        "kind of material",
        "optisense.materials",
        DesignError,
        {
            "dielectric": "optisense.design.materials.dielectric:Dielectric",
            "conductor": "optisense.design.materials.conductor:Conductor",
            "diffuse": "optisense.design.materials.diffuse:Diffuse",
            "absorber": "optisense.design.materials.absorber:Absorber",
        },
    )
    roles: ClassVar[tuple[Role, ...]] = (Role.MIRROR, Role.BLOCKER, Role.INDENTER)

    def medium(self) -> Medium | None:
        """The medium inside it; None for an opaque material."""
        return None

    def reflection(self) -> Reflection:
        """How it reflects, where it is opaque; nothing is reflected as it stands."""
        return Reflection()

    def in_words(self) -> str:
        """Its most telling number, in a few words."""
        return f"reflects {100 * float(self.reflection().head_on().mean()):.3g} %"

    def consequences(self) -> list[str]:
        """Quantities that follow from its numbers, a line each."""
        return []


class CoatingModel(KindModel):
    """The opaque coating of the sensing surface; each kind of coating is a subclass.

    Attributes:
        library: the library coating that it started from.
    """

    kinds: ClassVar[Registry[Any]] = Registry(
        "kind of coating",
        "optisense.coatings",
        DesignError,
        {"flake": "optisense.design.materials.coating:Coating"},
    )
    usual_kind: ClassVar[str] = "flake"

    library: Name | None = None

    @abstractmethod
    def reflection(self) -> Reflection:
        """How it reflects, its metal's index as in air."""

    def in_words(self) -> str:
        """Its most telling number, in a few words."""
        share = float(self.reflection().seen_in(GEL_INDEX).head_on().mean())
        return f"reflects {100 * share:.3g} % in silicone"

    def consequences(self) -> list[str]:
        """Quantities that follow from its numbers, a line each."""
        return []


def kinds_for(role: Role) -> tuple[str, ...]:
    """The kinds of material that a part of this role can be made of; none of a coated one.

    They are all loaded for this; `role in material.roles` tells it of one.
    """
    kinds = Material.kinds
    return tuple(name for name in kinds.names() if role in kinds.find(name).roles)
