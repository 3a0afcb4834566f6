"""Lines and images of the experiments' figures."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from optisense.figures import AMBER, BLUE, GREY, RED
from paper.spread import Spread

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLOURS = (BLUE, RED, AMBER, GREY, "#3c8d5a", "#6c4ab0", "#222222", "#b06a9a")
"""Colours of lines, in the order in which they are used."""


def line(
    axes: Axes, points: Mapping[str, Spread], label: str = "", colour: str = BLUE, mark: str = "o-"
) -> None:
    """Draw means with their standard deviations over seeds; the keys of `points` are x as text."""
    there = {x: each for x, each in points.items() if each["mean"] is not None}
    if not there:
        return
    axes.errorbar(
        [float(x) for x in there],
        [each["mean"] for each in there.values()],
        [each["standard_deviation"] or 0.0 for each in there.values()],
        fmt=mark,
        color=colour,
        label=label or None,
        capsize=3,
        markersize=4,
        linewidth=1.3,
    )


def finish(axes: Axes, title: str, x: str = "", y: str = "", legend: bool = False) -> None:
    """Set the title and the labels of the axes, and draw the grid and the legend."""
    axes.set_title(title, fontsize=10)
    axes.set_xlabel(x, fontsize=9)
    axes.set_ylabel(y, fontsize=9)
    axes.tick_params(labelsize=8)
    axes.grid(alpha=0.25)
    if legend and axes.get_legend_handles_labels()[0]:
        axes.legend(fontsize=8)


def image(axes: Axes, picture: NDArray[np.uint8] | None, title: str) -> None:
    """Draw a picture (h, w, 3), or an empty frame if there is none."""
    axes.set_xticks([])
    axes.set_yticks([])
    axes.set_title(title, fontsize=9)
    if picture is not None:
        axes.imshow(picture)
    else:
        axes.text(0.5, 0.5, "none", ha="center", va="center", transform=axes.transAxes)
