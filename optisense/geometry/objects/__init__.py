"""Everyday things to press into a sensor: a screw, a coin, a nut, a key, letters and others.

All are computed from formulas, so that no mesh files are needed. `optisense.tasks.verify` compares
designs with them, since no objective uses them; `object:coin@0,0:0.4` presses one.
"""

from optisense.geometry.objects._catalogue import OBJECTS, ObjectIndenter
from optisense.geometry.objects._relief import Relief

__all__ = ["OBJECTS", "ObjectIndenter", "Relief"]
