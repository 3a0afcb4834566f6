"""An empty figure, and the colours of figures. Matplotlib is imported when a figure is made."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.figure import Figure

BLUE, RED, GREY, PALE, AMBER = "#1f6fb2", "#c0392b", "#7b8794", "#c6d4e1", "#d98c1f"
"""Colours of data (the trials of a study), of a line or mark in it (the best trial), of the start,
of backgrounds, and of failures."""


def new_figure(width: float, height: float) -> Figure:
    """Return an empty figure; sizes are in inches."""
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), layout="constrained")
