"""Departures of a camera's lens from an ideal one: distortion, shading, blur.

Each of them has a base class with a registry of its kinds, and a file for each kind. `film` has the
positions of the pixels at which they are evaluated.
"""

from optisense.design.lenses._distortion import LensDistortion
from optisense.design.lenses.blur import LensBlur
from optisense.design.lenses.shading import LensShading

__all__ = ["LensBlur", "LensDistortion", "LensShading"]
