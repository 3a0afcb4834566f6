"""Make the pictures of docs/verify.md and docs/case-studies.md anew.

python scripts/verify_pictures.py                    the objects that are pressed
python scripts/verify_pictures.py svelte DESIGN      GelSight Svelte beside this one
python scripts/verify_pictures.py CASE START DESIGN  the start of a case study beside this design;
                                                     CASE is pad or gelbelt
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from matplotlib.colors import LightSource
from matplotlib.figure import Figure

import optisense as ots
from optisense.geometry import Contact
from optisense.geometry.objects import OBJECTS, ObjectIndenter
from optisense.mechanics._height_map import heights

OUT = Path(__file__).parent.parent / "docs" / "images"
PITCH = 0.03
"""Distance (mm) of the height samples of an object, which then has some 350 across."""
PHOTONS = 2_000_000
"""Number of photons of each picture, whose noise is then hardly visible."""


def objects() -> None:
    """Draw the twelve objects, lit from the side, and below each the picture of a GelSight Mini."""
    model = ots.OpticalModel(ots.load("gelsight-mini-ideal"))
    figure = Figure(figsize=(12, 8.6), layout="constrained")
    grid = figure.subplots(4, 6)
    side = np.arange(-5.2, 5.2, PITCH)
    for number, (name, relief) in enumerate(OBJECTS.items()):
        row, column = divmod(number, 6)
        height = np.minimum(heights(relief.mesh(), side, side), 1.2)
        light = LightSource(azdeg=315, altdeg=45)
        shaded = light.shade(
            -height, _copper(), dx=PITCH, dy=PITCH, blend_mode="soft", vmin=-1.2, vmax=0.0
        )
        shaded[~np.isfinite(height) | (height >= 1.2)] = 1.0
        contact = Contact(ObjectIndenter(name), at=(0.0, 0.0), depth=relief.depth)
        seen = model.render([contact], (320, 240), photons=PHOTONS).picture()
        above, below = grid[2 * row][column], grid[2 * row + 1][column]
        above.imshow(shaded, origin="lower")
        below.imshow(seen[30:210, 50:270])
        above.set_title(name, fontsize=11)
        for axes in (above, below):
            axes.set_axis_off()
    figure.savefig(OUT / "verify-objects.png", dpi=80)


def _copper() -> object:
    from matplotlib import colormaps

    return colormaps["copper"]


SHOWN = {
    "svelte": ("aoap", "coverage"),
    "pad": ("reading.mean_of_places", "coverage"),
    "gelbelt": ("uniformity", "coverage"),
}
"""Scores above the pictures, by the name of the case study."""


def side_by_side(case: str, start: str, better: str) -> None:
    """Draw two designs with nine balls pressed into each."""
    figure = Figure(figsize=(12, 4.9), layout="constrained")
    for axes, title, name in zip(
        figure.subplots(1, 2), ("start", "best"), (start, better), strict=True
    ):
        model = ots.OpticalModel(ots.load(name))
        scores = {each: ots.evaluate(model, each).value for each in SHOWN[case]}
        image = model.render(model.nine_contacts(), (480, 360), photons=PHOTONS)
        axes.imshow(image.picture())
        told = ", ".join(f"{each} {value:.2f}" for each, value in scores.items())
        axes.set_title(f"{title}: {told}")
        axes.set_axis_off()
    figure.savefig(OUT / f"case-{case}.png", dpi=75)


if __name__ == "__main__":
    if len(sys.argv) > 3:
        side_by_side(sys.argv[1], sys.argv[2], sys.argv[3])
    elif len(sys.argv) > 2:
        side_by_side(sys.argv[1], "gelsight-svelte", sys.argv[2])
    else:
        objects()
