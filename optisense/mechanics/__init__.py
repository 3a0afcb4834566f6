"""Mechanics of the gel: deformation of its skin under contacts, pressures and forces.

The functions compute the deformed skin of a design and its contacts, and do not depend on optics.
Names load on first use, as SciPy takes a while to import.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from optisense.lazy_names import load_on_first_use

if TYPE_CHECKING:
    from optisense.mechanics._contact_checks import is_attached, is_hollow, refuse_loose_gel
    from optisense.mechanics._deformed_mesh import SkinMesh, SkinState, skin_mesh
    from optisense.mechanics._elasticity import Elasticity, youngs_modulus_of_shore_a
    from optisense.mechanics._gel import Gel, elasticity_in_words, elasticity_of
    from optisense.mechanics._pressed_skin import Pressed, PressedSkin, SkinMaps
    from optisense.mechanics._rims import rims_in_words
    from optisense.mechanics.skins import CONFORMING, ELASTIC, SKINS

__all__ = [
    "CONFORMING",
    "ELASTIC",
    "SKINS",
    "Elasticity",
    "Gel",
    "Pressed",
    "PressedSkin",
    "SkinMaps",
    "SkinMesh",
    "SkinState",
    "elasticity_in_words",
    "elasticity_of",
    "is_attached",
    "is_hollow",
    "refuse_loose_gel",
    "rims_in_words",
    "skin_mesh",
    "youngs_modulus_of_shore_a",
]

if not TYPE_CHECKING:  # with __getattr__, type checkers would accept any name
    __getattr__, __dir__ = load_on_first_use(__name__, __file__)
