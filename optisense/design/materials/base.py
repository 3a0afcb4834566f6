"""The interface of all materials and coatings."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from optisense.design.fields import Name
from optisense.design.kinds import KindModel, Limits
from optisense.design.parts import Role
from optisense.design.reflectance import fresnel_metal
from optisense.errors import DesignError, LibraryError
from optisense.registry import Registry
from optisense.text import brief

RGB = tuple[float, float, float]

GEL_INDEX = 1.41
"""Refractive index of silicone, the medium in front of a coating in a sensor."""


@dataclass(frozen=True)
class Medium:
    """Optical medium of a transparent material.

    Attributes:
        ior: refractive index, for all colours if dispersion is not simulated.
        roughness: GGX alpha of its surface; 0 is smooth.
        absorption: absorption coefficient at R, G, B, 1/mm: after d mm the share exp(-absorption d)
            of the light is left (Beer and Lambert).
        indices: refractive index at R, G, B, for designs with dispersion; None if unknown, and
            `ior` holds for all.
    """

    ior: float
    roughness: float = 0.0
    absorption: RGB = (0.0, 0.0, 0.0)
    indices: RGB | None = None

    def __post_init__(self) -> None:
        _make_tuples(self)


@dataclass(frozen=True)
class Reflection:
    """Reflection at an opaque surface: a blend of a diffuse lobe and the lobe of a rough metal.

    The weights are 1 - `specularity` and `specularity`. With the defaults the surface is black.

    Attributes:
        reflectance: reflectance of the diffuse lobe at R, G, B, 0 to 1.
        specularity: weight of the metal's lobe, 0 to 1.
        roughness: GGX alpha of the metal's facets.
        eta, k: complex refractive index of the metal at R, G, B.
    """

    reflectance: RGB = (0.0, 0.0, 0.0)
    specularity: float = 0.0
    roughness: float = 1.0
    eta: RGB = (1.0, 1.0, 1.0)
    k: RGB = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        _make_tuples(self)

    @property
    def is_black(self) -> bool:
        """True if nothing is reflected."""
        return self.specularity == 0.0 and max(self.reflectance) == 0.0

    @property
    def is_metal(self) -> bool:
        """True if there is no diffuse lobe."""
        return self.specularity == 1.0

    def in_medium(self, ior: float) -> Reflection:
        """Return the same surface in a medium with this index, by which the metal's is divided."""
        eta, k = ((r / ior, g / ior, b / ior) for r, g, b in (self.eta, self.k))
        return replace(self, eta=eta, k=k)

    def normal_reflectance(self) -> NDArray[np.float64]:
        """Return the reflectance at normal incidence at R, G, B, (3,)."""
        metal = fresnel_metal(1.0, self.eta, self.k)
        diffuse = np.array(self.reflectance)
        return np.asarray((1.0 - self.specularity) * diffuse + self.specularity * metal)


def _make_tuples(result: Medium | Reflection) -> None:
    """Replace arrays and lists in it, which can't be compared and hashed, by tuples."""
    for name, value in vars(result).items():
        if isinstance(value, np.ndarray | list):
            object.__setattr__(result, name, tuple(np.asarray(value).tolist()))


SHARE = Limits("a number within 0..1", low=0.0, high=1.0)
"""Limits of a share or a GGX roughness."""

THREE_ABOVE_0 = Limits("3 numbers above 0", (3,), above=0.0)
"""Limits of a refractive index for R, G and B."""

THREE_FROM_0 = Limits("3 numbers that are not negative", (3,), low=0.0)
"""Limits of absorption coefficients (1/mm) or of the imaginary part of an index, for R, G and B."""

LIMITS: dict[type, dict[str, Limits]] = {
    Medium: {
        "ior": Limits("a number above 0", above=0.0),
        "roughness": SHARE,
        "absorption": THREE_FROM_0,
        "indices": THREE_ABOVE_0,
    },
    Reflection: {
        "reflectance": Limits("3 numbers within 0..1", (3,), 0.0, 1.0),
        "specularity": SHARE,
        "roughness": SHARE,
        "eta": THREE_ABOVE_0,
        "k": THREE_FROM_0,
    },
}
"""Limits of the attributes of what kinds return, beyond which nothing can be simulated."""


def _check_result(owner: KindModel, method: str, result: object, expected: type) -> None:
    """Raise LibraryError if a method has returned another type, or a number beyond `LIMITS`."""
    returned = f"{method}() of the {owner.kinds.noun} '{owner.kind}' returned"
    if not isinstance(result, expected):
        raise LibraryError(
            f"{returned} {brief(repr(result))}, which is no {expected.__name__}",
            hint="Repair the class of this kind",
        )
    for name, limits in LIMITS[expected].items():
        value = getattr(result, name)
        optional = name == "indices" and value is None
        if not (optional or limits.allow(value)):
            raise LibraryError(
                f"{returned} a {expected.__name__} whose {name} is {brief(repr(value))}",
                hint=f"Its {name} must be {limits.words}: change the numbers of the kind, or "
                "repair its class",
            )


class Material(KindModel):
    """Material of a part; each kind of material is a subclass.

    A kind is transparent, and has a `medium`, or opaque, and has a `reflection`.

    Attributes:
        roles: roles of the parts that can be made of it.
    """

    kinds: ClassVar[Registry[Any]] = Registry(
        "kind of material",
        "optisense.materials",
        DesignError,
        {
            "dielectric": "optisense.design.materials.dielectric:Dielectric",
            "conductor": "optisense.design.materials._opaque:Conductor",
            "diffuse": "optisense.design.materials._opaque:Diffuse",
            "absorber": "optisense.design.materials._opaque:Absorber",
        },
    )
    roles: ClassVar[tuple[Role, ...]] = (Role.MIRROR, Role.BLOCKER, Role.INDENTER)

    def medium(self) -> Medium | None:
        """Return the medium inside it; None for an opaque material."""
        return None

    def reflection(self) -> Reflection:
        """Return its reflection if it is opaque; black by default."""
        return Reflection()

    def _check_results(self) -> None:
        """Check its medium, or its reflection if it is opaque."""
        medium = self.medium()
        if medium is None:
            _check_result(self, "reflection", self.reflection(), Reflection)
        else:
            _check_result(self, "medium", medium, Medium)

    def in_words(self) -> str:
        """Return the most informative number of the material, in a few words."""
        return f"reflects {100 * float(self.reflection().normal_reflectance().mean()):.3g} %"

    def consequences(self) -> list[str]:
        """Return texts about quantities that follow from the numbers, such as reflectances."""
        return []


class CoatingModel(KindModel):
    """Opaque coating of the sensing surface; each kind of coating is a subclass.

    Attributes:
        library: name of the library coating that it started from.
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
        """Return its reflection, with the metal's index as in air."""

    def _check_results(self) -> None:
        """Check its reflection."""
        _check_result(self, "reflection", self.reflection(), Reflection)

    def in_words(self) -> str:
        """Return the most informative number of the material, in a few words."""
        share = float(self.reflection().in_medium(GEL_INDEX).normal_reflectance().mean())
        return f"reflects {100 * share:.3g} % in silicone"

    def consequences(self) -> list[str]:
        """Return texts about quantities that follow from the numbers, such as reflectances."""
        return []


def kinds_for(role: Role) -> tuple[str, ...]:
    """Return the kinds of material that a part of this role can be made of; none for the coated
    one.

    All kinds that can be loaded are loaded for this; `role in material.roles` tests a single one.
    """
    return tuple(name for name, kind in Material.kinds.loadable() if role in kind.roles)
