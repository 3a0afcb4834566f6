"""Elastic constants of a gel, and Young's modulus from its Shore hardness."""

from __future__ import annotations

import math
from dataclasses import dataclass

from optisense.design.materials.dielectric import MAX_POISSON_RATIO
from optisense.errors import ContactError


@dataclass(frozen=True)
class Elasticity:
    """Linear isotropic elasticity of a gel, and its friction.

    Attributes:
        youngs_modulus: Young's modulus, MPa (N/mm^2).
        poisson_ratio: Poisson's ratio, 0 to `MAX_POISSON_RATIO`.
        friction: coefficient of Coulomb friction between the skin and what touches it.
    """

    youngs_modulus: float
    poisson_ratio: float
    friction: float = 1.0

    def __post_init__(self) -> None:
        """Raise ContactError if one of the constants has no physical meaning."""
        if not (math.isfinite(self.youngs_modulus) and self.youngs_modulus > 0.0):
            raise ContactError(
                f"Young's modulus of a gel is {self.youngs_modulus:g} MPa",
                hint="Give a number above 0, in MPa",
            )
        if not 0.0 <= self.poisson_ratio <= MAX_POISSON_RATIO:
            raise ContactError(
                f"the Poisson ratio of a gel is {self.poisson_ratio:g}",
                hint=f"Give a number from 0 to {MAX_POISSON_RATIO:g}",
            )
        if not (math.isfinite(self.friction) and self.friction >= 0.0):
            raise ContactError(
                f"the friction coefficient of a gel is {self.friction:g}",
                hint="Give 0 or a number above it",
            )

    @property
    def shear_modulus(self) -> float:
        """Shear modulus (MPa), E / (2 (1 + nu))."""
        return self.youngs_modulus / (2.0 * (1.0 + self.poisson_ratio))


def youngs_modulus_of_shore_a(hardness: float) -> float:
    """Return Young's modulus (MPa) of a rubber from its Shore A hardness.

    The relation is Gent's, "On the relation between indentation hardness and Young's modulus",
    Rubber Chemistry and Technology 31 (1958): E = 0.0981 (56 + 7.62336 S) /
    (0.137505 (254 - 2.54 S)). It was found for S between about 20 and 80; softer rubbers are an
    extrapolation.

    Raises:
        ContactError: the hardness is not above 0 and below 100.
    """
    if not 0.0 < hardness < 100.0:
        raise ContactError(
            f"a Shore A hardness of {hardness:g} is outside the scale",
            hint="Give a number above 0 and below 100",
        )
    return 0.0981 * (56.0 + 7.62336 * hardness) / (0.137505 * (254.0 - 2.54 * hardness))
