"""Everyday things to press into a sensor: a screw, a coin, a nut, a key, letters and others.

All are made here from formulas, so that nobody has to look for mesh files. `optisense.tasks.verify`
judges designs by them, since no objective has seen any; `object:coin@0,0:0.4` presses one.
"""

from optisense.geometry.objects.catalogue import OBJECTS, ObjectIndenter
from optisense.geometry.objects.relief import Relief

__all__ = ["OBJECTS", "ObjectIndenter", "Relief"]
