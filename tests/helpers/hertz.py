"""The elastic constant of Hertz's theory."""

from __future__ import annotations

from optisense.mechanics import Elasticity


def plane_strain_modulus(material: Elasticity) -> float:
    """Return E / (1 - nu^2) (MPa), which governs the contact of a gel with a rigid body."""
    return material.youngs_modulus / (1.0 - material.poisson_ratio**2)
