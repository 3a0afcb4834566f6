"""Make the pictures of docs/sensors.md, and of coatings in docs/design-file.md, anew.

python scripts/sensor_pictures.py [sections] [digit] [gelbelt] [gelsight360] [gelsight-svelte]
    [coatings]
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import get_args

import numpy as np
from matplotlib.figure import Figure
from matplotlib.image import imsave

from optisense import Contact, OpticalModel, Sphere, sensors
from optisense.design import SensorDesign, set_value
from optisense.design.materials.coating import Scattering
from optisense.design.section_drawing import section_svg

OUT = Path(__file__).parent.parent / "docs" / "images"
DRAWN = ("digit", "gelsight-mini", "gelbelt", "gelsight360", "gelsight-svelte")
PHOTONS = 2_000_000
"""Number of photons of each picture, whose noise is then hardly visible."""
TALL = (240, 320)
"""Width and height (pixels) of DIGIT's picture, whose camera is upright."""
SPECULARITY = 0.6
"""Specularity (0 to 1) at which the meanings of a coating's specularity are compared."""


def sections() -> None:
    """Draw a labelled section through each sensor."""
    for name in DRAWN:
        path = OUT / f"{name}-section.svg"
        path.write_text(section_svg(sensors.build(name)), encoding="utf-8")
        print(path)


def tactile(design: SensorDesign, resolution: tuple[int, int] = (320, 240)) -> np.ndarray:
    """Return the camera's picture (h, w, 3), uint8, of nine pressed balls."""
    model = OpticalModel(design)
    image = model.render(model.nine_contacts(), resolution=resolution, photons=PHOTONS)
    return image.picture()


def side_by_side(name: str, panels: dict[str, np.ndarray], width: float = 4.0) -> None:
    """Write pictures, which are given by their titles, each `width` inches wide."""
    figure = Figure(figsize=(width * len(panels), 0.85 * width), facecolor="white")
    axes = np.atleast_1d(figure.subplots(1, len(panels)))
    for axis, (title, picture) in zip(axes, panels.items(), strict=True):
        axis.imshow(picture)
        axis.set_title(title, fontsize=11)
        axis.set_axis_off()
    figure.tight_layout()
    figure.savefig(OUT / f"{name}.png", dpi=100, bbox_inches="tight")
    print(OUT / f"{name}.png")


def digit() -> None:
    """Draw DIGIT with LEDs of different heights and edges of different finishes."""
    usual = sensors.digit()
    panels: dict[str, np.ndarray] = {}
    for height, title, picture in (
        (1.5, "untouched", untouched(usual)),
        (4.6, "nine balls", tactile(usual, TALL)),
    ):
        panels[title] = picture
        for roughness, finish in ((0.0, "polished"), (0.3, "matt"), (1.0, "rough")):
            title = f"{height:g} mm, {finish}"
            design = sensors.digit(led_height=height, edge_roughness=roughness)
            panels[title] = untouched(design)
    figure = Figure(figsize=(10.0, 7.0), facecolor="white")
    for axis, (title, picture) in zip(figure.subplots(2, 4).flat, panels.items(), strict=True):
        axis.imshow(picture)
        axis.set_title(title, fontsize=11)
        axis.set_axis_off()
    figure.tight_layout()
    figure.savefig(OUT / "digit.png", dpi=80, bbox_inches="tight")
    print(OUT / "digit.png")


def untouched(design: SensorDesign) -> np.ndarray:
    """Return the picture (h, w, 3), uint8, of a DIGIT that nothing touches."""
    return OpticalModel(design).render([], resolution=TALL, photons=PHOTONS).picture()


def gelbelt() -> None:
    """Draw GelBelt's three light designs."""
    panels = {
        f"light design {number}": tactile(sensors.gelbelt(light_design=number))
        for number in (1, 2, 3)
    }
    side_by_side("gelbelt", panels)


def gelsight360() -> None:
    imsave(OUT / "gelsight360.png", tactile(sensors.gelsight360()))
    print(OUT / "gelsight360.png")


def svelte() -> None:
    """Draw GelSight Svelte's whole view in mirror M2, and that of the palm only."""
    panels = {
        "view='m2' (default)": tactile(sensors.gelsight_svelte()),
        "view='palm'": tactile(sensors.gelsight_svelte(view="palm")),
    }
    side_by_side("gelsight-svelte", panels)


def coatings() -> None:
    """Draw one contact of GelSight Mini with each meaning of a specularity."""
    model = OpticalModel(
        set_value(sensors.gelsight_mini_ideal(), "coating.specularity", SPECULARITY)
    )
    panels = {}
    for scattering in get_args(Scattering):
        model.update("coating.scattering", scattering)
        ball = Contact(Sphere(radius=4.0), at=(0.0, 0.0), depth=1.0)
        image = model.render([ball], resolution=(320, 240), photons=PHOTONS)
        panels[scattering] = image.picture()
    side_by_side("coating-scattering", panels, width=2.6)


if __name__ == "__main__":
    OUT.mkdir(parents=True, exist_ok=True)
    makers = {
        "sections": sections,
        "digit": digit,
        "gelbelt": gelbelt,
        "gelsight360": gelsight360,
        "gelsight-svelte": svelte,
        "coatings": coatings,
    }
    for wanted in sys.argv[1:] or list(makers):
        makers[wanted]()
