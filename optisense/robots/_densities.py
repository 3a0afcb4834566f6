"""Densities of the parts of a sensor, g/cm^3."""

from __future__ import annotations

from optisense.design import Role
from optisense.workshop.shapes import Shape

OF_MATERIALS: dict[str, float] = {
    "silicone-solaris": 0.99,  # Smooth-On, technical bulletin of Solaris: specific gravity
    "pdms": 1.03,  # Dow, data sheet of Sylgard 184
    "polycarbonate": 1.20,  # ISO 1183, usual in data sheets
    "glass-bk7": 2.51,  # Schott, data sheet of N-BK7
}
"""Densities (g/cm^3) of materials of the library that differ from those of their roles, from the
sources beside them."""

OF_ROLES: dict[Role, float] = {
    Role.SENSING_SURFACE: 1.03,
    Role.ELASTOMER: 1.03,  # of PDMS, close to that of most silicones
    Role.SUPPORT: 1.19,  # of acrylic glass (PMMA, ISO 1183)
    Role.INTERFACE: 1.19,  # the same
    Role.MIRROR: 2.50,  # of float glass (EN 572)
    Role.BLOCKER: 1.24,  # of printed PLA without cavities
}
"""Densities (g/cm^3) that are assumed for the parts of a role: those of its usual material, which
is named beside each."""


def density_of(shape: Shape) -> float:
    """Return the density of a part, g/cm^3, by its material in the library or else by its role."""
    return OF_MATERIALS.get(shape.material or "", OF_ROLES[shape.role])
