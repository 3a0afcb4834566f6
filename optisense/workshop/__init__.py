"""Out to the workshop: shapes to print or machine, where the LEDs go, and what to buy."""

from optisense.workshop.bill_of_materials import Bill, bill_of_materials
from optisense.workshop.export import FORMATS, export
from optisense.workshop.placement import Placement, placements

__all__ = [
    "FORMATS",
    "Bill",
    "Placement",
    "bill_of_materials",
    "export",
    "placements",
]
