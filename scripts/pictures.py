"""Make the pictures of the README and docs anew: python scripts/pictures.py"""

from __future__ import annotations

from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

import optisense as ots

OUT = Path(__file__).parent.parent / "docs" / "images"
VARIANTS = {
    "gelsight-mini": "flat",
    "gelsight-mini-cylindrical": "cylindrical",
    "gelsight-mini-spherical": "spherical",
}


def main() -> None:
    """Write each variant's picture with nine balls, and one of all three side by side."""
    OUT.mkdir(parents=True, exist_ok=True)
    figure, axes = plt.subplots(1, 3, figsize=(12, 3.3), facecolor="white")
    for axis, (name, label) in zip(axes, VARIANTS.items(), strict=True):
        model = ots.OpticalModel(ots.load(name))
        image = model.render(model.nine_contacts(), resolution=(640, 480), photons=8_000_000)
        picture = image.picture()
        plt.imsave(OUT / f"{name}.png", picture)
        axis.imshow(picture)
        axis.set_title(f"GelSight Mini, {label} gel", fontsize=11)
        axis.set_axis_off()
        print(OUT / f"{name}.png")
    figure.tight_layout(pad=0.4)
    figure.savefig(OUT / "gelsight-mini-variants.png", dpi=100)
    print(OUT / "gelsight-mini-variants.png")


if __name__ == "__main__":
    main()
