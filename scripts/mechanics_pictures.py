"""Make the pictures of docs/mechanics.md anew: python scripts/mechanics_pictures.py"""

from __future__ import annotations

from pathlib import Path

from matplotlib.figure import Figure

import optisense as ots
from optisense.geometry.contact_text import parse_contact
from optisense.mechanics import SKINS

OUT = Path(__file__).parent.parent / "docs" / "images"
PHOTONS = 1_000_000
RESOLUTION = 400, 300


def skins() -> None:
    """A screw, a coin and nine balls on a GelSight Mini, with either skin."""
    model = ots.OpticalModel(ots.load("gelsight-mini"))
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


if __name__ == "__main__":
    skins()
