"""Materials of parts and coatings of the sensing surface.

`Material` stands for any material of a part, `CoatingModel` for any coating.
"""

from optisense.design.materials._opaque import Absorber, Conductor, Diffuse
from optisense.design.materials.base import (
    CoatingModel,
    Material,
    Medium,
    Reflection,
    kinds_for,
)
from optisense.design.materials.coating import Coating, flake_lobe, specularity_to_roughness
from optisense.design.materials.dielectric import Dielectric

__all__ = [
    "Absorber",
    "Coating",
    "CoatingModel",
    "Conductor",
    "Dielectric",
    "Diffuse",
    "Material",
    "Medium",
    "Reflection",
    "flake_lobe",
    "kinds_for",
    "specularity_to_roughness",
]
