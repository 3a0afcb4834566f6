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


def render_variants() -> None:
    """Draw nine balls pressed into each variant of GelSight Mini."""
    for name in VARIANTS:
        model = ots.OpticalModel(ots.load(name))
        image = model.render(model.nine_contacts(), resolution=(640, 480), photons=8_000_000)
        plt.imsave(OUT / f"{name}.png", image.picture())
        print(OUT / f"{name}.png")


def show_side_by_side() -> None:
    """Draw all variants in one picture."""
    figure, axes = plt.subplots(1, 3, figsize=(12, 3.4), facecolor="white")
    for axis, (name, label) in zip(axes, VARIANTS.items(), strict=True):
        axis.imshow(plt.imread(OUT / f"{name}.png"))
        axis.set_title(f"GelSight Mini, {label} gel", fontsize=12)
        axis.set_axis_off()
    figure.tight_layout()
    figure.savefig(OUT / "gelsight-mini-variants.png", dpi=100, bbox_inches="tight")
    print(OUT / "gelsight-mini-variants.png")


if __name__ == "__main__":
    OUT.mkdir(parents=True, exist_ok=True)
    render_variants()
    show_side_by_side()
