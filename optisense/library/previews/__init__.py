"""Preview pictures: the ball of a material, the polar plot of a light, the field of a camera."""

from __future__ import annotations

from pathlib import Path
from textwrap import shorten
from typing import TYPE_CHECKING, Any

from optisense.library._entries import AnyEntry, LightEntry
from optisense.library.previews._ball import picture_of_ball
from optisense.library.previews._material import draw_material
from optisense.library.previews.camera import draw_camera
from optisense.library.previews.light import draw_light
from optisense.writing import written_whole

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["draw", "picture_of_ball", "save"]

DOTS_PER_INCH = 110
"""Resolution of the pictures, dots per inch: letters of 9 points are then 14 pixels high, easy to
read on a usual screen."""

LONGEST = 130
"""Number of characters of a description that fit across the picture, which is 9 inches wide."""


def draw(name: str, entry: AnyEntry) -> Figure:
    """Return the preview picture of an entry: 990 x 451 pixels when saved by `save`.

    Raises:
        LibraryError: the IES file of a light is missing or malformed.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 4.1), dpi=DOTS_PER_INCH)
    figure.subplots_adjust(left=0.05, right=0.97, top=0.78, bottom=0.13, wspace=0.22)
    figure.suptitle(name, x=0.03, y=0.98, ha="left", va="top", fontsize=14, weight="bold")
    about = shorten(entry.description, LONGEST, placeholder=" ...")
    figure.text(0.03, 0.905, about, ha="left", va="top", fontsize=9, color="0.35")
    value: Any = entry.value
    if isinstance(entry, LightEntry):
        draw_light(figure, entry)
    elif hasattr(value, "fov"):
        draw_camera(figure, value)
    else:
        draw_material(figure, value)
    return figure


def save(figure: Figure, path: Path) -> None:
    """Write a figure as PNG, whole or not at all.

    Raises:
        OutputError: the file can't be written.
    """
    with written_whole(path, "the picture", "Choose another file after --out") as temporary:
        figure.savefig(temporary, format="png", dpi=DOTS_PER_INCH)
