"""Make the pictures of docs/datasets.md and docs/tasks.md anew: python scripts/task_pictures.py"""

from __future__ import annotations

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import trimesh
from matplotlib.figure import Figure
from shapely.geometry import Point, Polygon

import optisense as ots
from optisense.tasks import (
    ContactDraw,
    DatasetSettings,
    Misalignment,
    ReconstructionSettings,
    SampleSettings,
    generate,
    perceive,
    reconstruct,
)
from optisense.tasks.figures import draw_perception, draw_reconstruction

OUT = Path(__file__).parent.parent / "docs" / "images"
PHOTONS = 1_000_000
"""Number of photons of each picture, whose noise is then hardly visible."""


def hex_nut(path: Path) -> None:
    """Write a flat-lying nut with a hole and corners at 3 mm from its axis as STL."""
    turns = np.radians(np.arange(6) * 60)
    outline = Polygon(3.0 * np.column_stack([np.cos(turns), np.sin(turns)]))
    solid = trimesh.creation.extrude_polygon(outline - Point(0, 0).buffer(1.5), 2.0)
    solid.export(path)


def dataset(model: ots.OpticalModel) -> None:
    """Draw pictures, depth and normals of four samples."""
    with TemporaryDirectory() as folder:
        nut = Path(folder) / "nut.stl"
        hex_nut(nut)
        settings = DatasetSettings(
            ContactDraw(("sphere:2", "cylinder:1.5,6", f"mesh:{nut}"), (0.4, 0.8), tilt=8),
            resolution=(240, 180),
            photons=PHOTONS,
            seed=5,
        )
        made = generate(model, Path(folder) / "touches", 4, settings)
        figure = Figure(figsize=(10, 6), layout="constrained")
        for column, sample in zip(figure.subplots(3, 4).T, made, strict=True):
            column[0].imshow(sample.image)
            column[1].imshow(sample.depth, vmin=0, vmax=0.8, cmap="viridis")
            column[2].imshow(0.5 - 0.5 * sample.normals)
            name = sample.labels["indenter"].replace(str(nut), "nut.stl")
            column[0].set_title(f"{name}, {sample.labels['depth']:.2f} mm deep", fontsize=10)
            for axes, title in zip(column, ("image", "depth", "normals"), strict=True):
                axes.set_xticks([])
                axes.set_yticks([])
                if column[0] is figure.axes[0]:
                    axes.set_ylabel(title)
        figure.suptitle(model.design.name, fontsize=11)
        _save(figure, "dataset")


def misalignment(model: ots.OpticalModel) -> None:
    """Draw estimated against true angles."""
    settings = SampleSettings(count=80, resolution=(32, 24), photons=PHOTONS)
    _save(draw_perception(perceive(Misalignment(), model, settings)), "task-misalignment")


def reconstruction(model: ots.OpticalModel) -> None:
    """Draw three shapes to which the network was not fitted."""
    settings = ReconstructionSettings(resolution=(160, 120), photons=PHOTONS)
    result = reconstruct(model, settings)
    _save(draw_reconstruction(result, model.design.camera.axes()), "task-reconstruction")


def _save(figure: Figure, name: str) -> None:
    figure.savefig(OUT / f"{name}.png", dpi=90)
    print(OUT / f"{name}.png")


if __name__ == "__main__":
    mini = ots.OpticalModel(ots.load("gelsight-mini-ideal"))
    for draw in (dataset, misalignment, reconstruction):
        if len(sys.argv) == 1 or draw.__name__ in sys.argv[1:]:
            draw(mini)
