"""Departures of a camera's lens from an ideal one: distortion, shading, blur.

Each of them has a file with a base class, a registry of its kinds, and the kinds. `film` has the
positions of the pixels at which they are evaluated.
"""

from optisense.design.lenses.blur import LensBlur
from optisense.design.lenses.distortion import LensDistortion
from optisense.design.lenses.shading import LensShading

__all__ = ["LensBlur", "LensDistortion", "LensShading"]
