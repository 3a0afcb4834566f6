"""Departures of a camera's lens from an ideal one: distortion, shading, blur.

Each noun has a base class with a registry of its kinds, and a file for each kind. `film` has the
places of a picture's pixels that they are asked about.
"""

from optisense.design.lenses.blur import LensBlur
from optisense.design.lenses.distortion import LensDistortion
from optisense.design.lenses.shading import LensShading

__all__ = ["LensBlur", "LensDistortion", "LensShading"]
