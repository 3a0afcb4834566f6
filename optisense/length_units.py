"""Units of length of CAD files, for recipes, commands and front ends, in one table."""

from __future__ import annotations

from typing import Literal

Units = Literal["mm", "cm", "m", "inch", "um", "mil"]
MM_PER: dict[str, float] = {
    "mm": 1.0,
    "cm": 10.0,
    "m": 1000.0,
    "inch": 25.4,
    "um": 0.001,
    "mil": 0.0254,
}
"""Millimetres in each unit that CAD tools export."""
