"""Export to the workshop: shapes to print or machine, positions of LEDs, bill of materials."""

from optisense.workshop._bill_of_materials import Bill, bill_of_materials
from optisense.workshop._placement import Placement, placements
from optisense.workshop.export import export
from optisense.workshop.formats import FORMATS, ShapeFormat

__all__ = [
    "FORMATS",
    "Bill",
    "Placement",
    "ShapeFormat",
    "bill_of_materials",
    "export",
    "placements",
]
