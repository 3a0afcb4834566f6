"""Make the pictures of the guides to cages and to one's own CAD files anew.

python scripts/guide_pictures.py [cages] [pad]
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.image import imsave

import optisense as ots
from optisense.design import move_points
from optisense.design.section_drawing import section_svg
from optisense.geometry import parse_contact
from optisense.sensors.from_meshes import design_from_meshes

ROOT = Path(__file__).parent.parent
OUT = ROOT / "docs" / "images"
EXAMPLE = ROOT / "docs" / "examples" / "pad-sensor"
TOUCH = ("sphere:2@0,0:0.8", "sphere:1@-6,4:0.5", "cylinder:1,8@5,-3:0.4:30")

MOVED, STILL, INK = "#c2410c", "#475569", "#1c232b"


def cages() -> None:
    """Draw a cage at rest, one that bends, and the range of a mirror between its two ends."""
    figure = Figure(figsize=(13.0, 3.4), facecolor="white")
    rest = ots.load("gelsight-mini")
    bent = move_points(rest, "skin", {"1,*,2": (0.0, 0.0, 6.0)})
    for place, design, title in (
        (1, rest, "at rest: 27 control points"),
        (2, bent, "row 1,*,2 moved up by 6 mm"),
    ):
        axes = figure.add_axes((0.31 * (place - 1), 0.0, 0.32, 0.92), projection="3d")
        _draw_cage(axes, design, rest)
        axes.set_title(title, fontsize=11, color=INK)
    axes = figure.add_axes((0.67, 0.2, 0.24, 0.6))
    _draw_range(axes)
    figure.savefig(OUT / "cages.png", dpi=100)
    print(OUT / "cages.png")


def _draw_cage(axes: Any, design: ots.SensorDesign, rest: ots.SensorDesign) -> None:
    skin = design.deformed_meshes()["skin"]
    axes.plot_trisurf(
        *skin.vertices.T,
        triangles=skin.faces[:, ::-1],
        color="#dbe4f0",
        alpha=0.6,
        linewidth=0.0,
        antialiased=False,
    )
    cage = design.cages["skin"]
    points = cage.current_points().reshape(*cage.resolution, 3)
    before = rest.cages["skin"].current_points().reshape(points.shape)
    for axis in range(3):
        for line in np.moveaxis(points, axis, 2).reshape(-1, cage.resolution[axis], 3):
            axes.plot(*line.T, color="#94a3b8", linewidth=0.7)
    moved = np.linalg.norm(points - before, axis=-1) > 1e-9
    axes.scatter(*points[~moved].T, color=STILL, s=14, depthshade=False)
    axes.scatter(*points[moved].T, color=MOVED, s=26, depthshade=False)
    for start, end in zip(before[moved], points[moved], strict=True):
        axes.quiver(*start, *(end - start), color=MOVED, linewidth=1.2, arrow_length_ratio=0.15)
    axes.set_xlim(-12.7, 12.7)
    axes.set_ylim(-10.4, 10.4)
    axes.set_zlim(-4.3, 6.5)
    axes.set_box_aspect((25.4, 20.8, 10.8), zoom=1.3)
    axes.view_init(elev=20, azim=-62)
    axes.set_clip_on(False)
    for artist in (*axes.lines, *axes.collections):
        artist.set_clip_on(False)
    axes.set_axis_off()


def _draw_range(axes: Any) -> None:
    """Draw mirror M1 of GelSight Svelte in the plane y = 0."""
    design = ots.load("gelsight-svelte")
    rest = design.meshes["M1"].vertices
    middle = np.abs(rest[:, 1]) < 1e-6
    order = np.argsort(rest[middle, 0] + rest[middle, 2])
    for share in np.linspace(0.0, 1.0, 5):
        shape = ots.set_value(design, "cages.M1.blend", float(share)).deformed_meshes()["M1"]
        height, _, along = shape.vertices[middle][order].T
        end = share in (0.0, 1.0)
        axes.plot(along, height, color=MOVED if end else "#94a3b8", linewidth=2.0 if end else 1.2)
        text = {0.0: "A = 0: C_min", 1.0: "A = 1: C_max"}.get(float(share), "")
        axes.annotate(
            text, (along[-1], height[-1]), (4, 0), textcoords="offset points", va="center",
            fontsize=9, color=INK, annotation_clip=False,
        )  # fmt: skip
    axes.set_aspect("equal")
    axes.set_title("mirror M1 of GelSight Svelte, A in steps of 0.25", fontsize=11, color=INK)
    axes.set_xlabel("along the finger, z (mm)")
    axes.set_ylabel("x (mm)")
    axes.spines[["top", "right"]].set_visible(False)


def pad() -> None:
    """Draw the example of the guide to one's own CAD files: a section, and the camera's picture."""
    design = design_from_meshes(EXAMPLE / "sensor.yaml").design
    (OUT / "pad-sensor-section.svg").write_text(section_svg(design), encoding="utf-8")
    print(OUT / "pad-sensor-section.svg")
    model = ots.OpticalModel(design)
    contacts = [parse_contact(text) for text in TOUCH]
    image = model.render(contacts, resolution=(640, 480), photons=8_000_000)
    imsave(OUT / "pad-sensor.png", image.picture())
    print(OUT / "pad-sensor.png")


if __name__ == "__main__":
    OUT.mkdir(parents=True, exist_ok=True)
    makers = {"cages": cages, "pad": pad}
    for name in sys.argv[1:] or makers:
        makers[name]()
