"""Helper functions for the figures of a page."""

from __future__ import annotations

import base64
import io
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

DOTS_PER_INCH = 110
"""Resolution of figures, dots per inch, which makes them as wide as the page's text."""


def legend_above(axes: Axes, columns: int = 2) -> None:
    """Draw a legend above a plot, where it covers nothing of it."""
    axes.legend(
        fontsize=8,
        loc="lower left",
        bbox_to_anchor=(0.0, 1.0),
        ncols=columns,
        frameon=False,
        borderaxespad=0.2,
    )


def figure_uri(figure: Figure) -> str:
    """Return a figure as the address of an ``<img>`` that contains its data."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=DOTS_PER_INCH)
    return "data:image/png;base64," + base64.b64encode(buffer.getvalue()).decode("ascii")


def swatch_of(colour: Sequence[float]) -> str:
    """Return the colour of a light as CSS, scaled to a brightest channel of 255.

    Args:
        colour: colour (3,) of the light, on any scale.
    """
    brightest = max(*colour, 1e-9)
    red, green, blue = (round(255 * value / brightest) for value in colour)
    return f"rgb({red}, {green}, {blue})"


def encoded(values: NDArray[Any], dtype: Any) -> str:
    """Encode an array (any shape) for a page's script: little-endian numbers as base64 text."""
    little_endian = np.ascontiguousarray(values, dtype=np.dtype(dtype).newbyteorder("<"))
    return base64.b64encode(little_endian.tobytes()).decode("ascii")
