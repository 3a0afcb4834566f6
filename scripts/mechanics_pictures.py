"""Make the pictures of docs/mechanics.md anew: python scripts/mechanics_pictures.py"""

from __future__ import annotations

from pathlib import Path

from matplotlib.figure import Figure

import optisense as ots
from optisense.design import Markers
from optisense.geometry.contact_text import parse_contact
from optisense.mechanics import SKINS

OUT = Path(__file__).parent.parent / "docs" / "images"
PHOTONS = 1_000_000
"""Number of photons of each picture, whose noise is then hardly visible."""
RESOLUTION = 400, 300
"""Width and height (pixels) of the pictures of contacts."""
ENLARGED = 8
"""Factor by which the arrows of markers are longer than their motion."""


def skins() -> None:
    """Draw a screw, a coin and nine balls on a GelSight Mini, with either skin."""
    model = ots.OpticalModel(ots.load("gelsight-mini-ideal"))
    pressed = {
        "screw, 0.5 mm deep": [parse_contact("object:screw-thread@0,0:0.5")],
        "coin, 0.4 mm deep": [parse_contact("object:coin@0,0:0.4")],
        "balls, 0.8 mm deep": model.nine_contacts(),
    }
    exposure = model.render(resolution=RESOLUTION, photons=PHOTONS).auto_exposure()
    figure = Figure(figsize=(8.4, 4.5), layout="constrained")
    grid = figure.subplots(2, 3)
    for column, (name, contacts) in enumerate(pressed.items()):
        for row, skin in enumerate(reversed(SKINS)):
            seen = model.render(contacts, RESOLUTION, photons=PHOTONS, skin=skin)
            axes = grid[row][column]
            axes.imshow(seen.picture(exposure))
            axes.set_title(f"{name}: {skin}", fontsize=9)
            axes.set_axis_off()
    figure.savefig(OUT / "skins.jpg", dpi=150, pil_kwargs={"quality": 88})


def markers() -> None:
    """Draw dots on a GelSight Mini under a ball, and arrows of their motion."""
    design = ots.load("gelsight-mini-ideal")
    design.markers = Markers(grid=(11, 9), pitch=1.5, radius=0.3)
    ball = ots.Contact(ots.Sphere(4.0), at=(0.0, 0.0), depth=1.2)
    seen = ots.OpticalModel(design).render([ball], RESOLUTION, photons=PHOTONS)
    figure = Figure(figsize=(8.4, 3.4), layout="constrained")
    left, right = figure.subplots(1, 2)
    left.imshow(seen.picture())
    right.imshow(seen.contact_mask, cmap="Greys", vmax=4)
    places = seen.markers
    assert places is not None
    motion = places.after - places.before
    right.quiver(
        *places.before.T, *(ENLARGED * motion.T), angles="xy", scale_units="xy", scale=1, width=4e-3
    )
    left.set_title("ball of 4 mm, 1.2 mm deep", fontsize=9)
    right.set_title(f"motion of the dots, {ENLARGED} times as long, and the contact", fontsize=9)
    for axes in (left, right):
        axes.set_axis_off()
    figure.savefig(OUT / "markers.png", dpi=110)


if __name__ == "__main__":
    skins()
    markers()
