"""Export to the workshop: shapes to print or machine, positions of the LEDs, and a bill of
materials.
"""

from optisense.workshop.bill_of_materials import Bill, bill_of_materials
from optisense.workshop.export import export
from optisense.workshop.formats import FORMATS, ShapeFormat
from optisense.workshop.placement import Placement, placements

__all__ = [
    "FORMATS",
    "Bill",
    "Placement",
    "ShapeFormat",
    "bill_of_materials",
    "export",
    "placements",
]
