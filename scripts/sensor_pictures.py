"""Make the pictures of docs/sensors.md anew.

python scripts/sensor_pictures.py [sections] [gelbelt] [gelsight360] [gelsight-svelte]
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from matplotlib.image import imsave

from optisense import OpticalModel, sensors
from optisense.design import SensorDesign
from optisense.design.section_drawing import section_svg

OUT = Path(__file__).parent.parent / "docs" / "images"
DRAWN = ("gelsight-mini", "gelbelt", "gelsight360", "gelsight-svelte")
PHOTONS = 2_000_000


def sections() -> None:
    """A labelled section through each sensor."""
    for name in DRAWN:
        path = OUT / f"{name}-section.svg"
        path.write_text(section_svg(sensors.build(name)), encoding="utf-8")
        print(path)


def tactile(design: SensorDesign) -> np.ndarray:
    """(h, w, 3) uint8: nine balls pressed in, as the camera sees them."""
    model = OpticalModel(design)
    image = model.render(model.nine_contacts(), resolution=(320, 240), photons=PHOTONS)
    return image.picture()


def side_by_side(name: str, panels: dict[str, np.ndarray]) -> None:
    figure = Figure(figsize=(4.0 * len(panels), 3.4), facecolor="white")
    axes = np.atleast_1d(figure.subplots(1, len(panels)))
    for axis, (title, picture) in zip(axes, panels.items(), strict=True):
        axis.imshow(picture)
        axis.set_title(title, fontsize=11)
        axis.set_axis_off()
    figure.tight_layout()
    figure.savefig(OUT / f"{name}.png", dpi=100, bbox_inches="tight")
    print(OUT / f"{name}.png")


def gelbelt() -> None:
    """Its three light designs."""
    panels = {
        f"light design {number}": tactile(sensors.gelbelt(light_design=number))
        for number in (1, 2, 3)
    }
    side_by_side("gelbelt", panels)


def gelsight360() -> None:
    imsave(OUT / "gelsight360.png", tactile(sensors.gelsight360()))
    print(OUT / "gelsight360.png")


def svelte() -> None:
    """The whole of what M2 shows, and the palm only."""
    panels = {
        "view='m2' (default)": tactile(sensors.gelsight_svelte()),
        "view='palm'": tactile(sensors.gelsight_svelte(view="palm")),
    }
    side_by_side("gelsight-svelte", panels)


if __name__ == "__main__":
    OUT.mkdir(parents=True, exist_ok=True)
    makers = {
        "sections": sections,
        "gelbelt": gelbelt,
        "gelsight360": gelsight360,
        "gelsight-svelte": svelte,
    }
    for wanted in sys.argv[1:] or list(makers):
        makers[wanted]()
