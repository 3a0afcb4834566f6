"""Preview of a camera: its angles of view, and the area that it covers of a plane at a distance."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from optisense.array_types import FloatArray
from optisense.design.camera import Camera
from optisense.design.projection import directions
from optisense.library._entries import CameraModel

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

DISTANCES = (40.0, 20.0, 10.0)
"""Distances in front of the pupil at which the preview draws the camera's field, mm: those of skins
in tactile sensors."""

STEEPEST = 80.0
"""Largest angle from the axis up to which a footprint is drawn, degrees: it is then nearly six
times as far from the axis as from the camera, and grows without limit towards 90."""

SIDE_POINTS = 64
"""Number of points on each side of the border of an image; the curved border of a fisheye's
footprint then looks smooth."""


def border_directions(camera: CameraModel) -> FloatArray:
    """Return unit directions (n, 3) of n = 4 `SIDE_POINTS` points of the image's border: x right, y
    up, z ahead.

    The lens is ideal: its distortion is left out.
    """
    ideal = Camera(
        model="ideal",
        position=(0.0, 0.0, 0.0),
        direction=(0.0, 0.0, 1.0),
        up=(0.0, -1.0, 0.0),  # image right is direction x up, which is then +x
        fov=camera.fov,
        resolution=camera.resolution,
        projection=camera.projection,
    )
    t = np.linspace(0.0, 1.0, SIDE_POINTS, endpoint=False)
    low, high = np.zeros(SIDE_POINTS), np.ones(SIDE_POINTS)
    across = np.concatenate([t, high, 1.0 - t, low])
    return directions(ideal, across, np.concatenate([low, t, high, 1.0 - t]))


def footprint(camera: CameraModel, distance: float) -> FloatArray:
    """Return the border (n, 2), mm, of the visible area of a plane across the axis at a distance
    (mm), without refraction.

    Beyond `STEEPEST` degrees from the axis the border is cut, as it extends to infinity.
    """
    border = border_directions(camera)
    side = np.hypot(border[:, 0], border[:, 1])
    angle = np.minimum(np.arctan2(side, border[:, 2]), np.radians(STEEPEST))
    return border[:, :2] / side[:, None] * (distance * np.tan(angle))[:, None]


def footprint_size(camera: CameraModel, distance: float) -> tuple[float, float]:
    """Return width and height (mm), through its middle, of the visible area of a plane across the
    axis at a distance (mm).
    """
    wide, high, _ = camera.angles()
    angles = np.minimum(np.array([wide, high]) / 2.0, STEEPEST)
    width, height = 2.0 * distance * np.tan(np.radians(angles))
    return float(width), float(height)


def draw_camera(figure: Figure, camera: CameraModel) -> None:
    """Draw both pictures into a figure."""
    _angles(figure.add_axes((0.04, 0.10, 0.42, 0.68)), camera)
    _footprints(figure.add_axes((0.55, 0.22, 0.42, 0.58)), camera)


def _angles(axes: Axes, camera: CameraModel) -> None:
    """Draw wedges of the angles across, from above: the diagonal, the width and the height."""
    from matplotlib.patches import Wedge

    wide, high, diagonal = camera.angles()
    for angle, reach, shade, label in (
        (diagonal, 1.0, "#dbe7f7", f"diagonal {diagonal:.1f}°"),
        (wide, 0.8, "#a9c6ec", f"width {wide:.1f}°"),
        (high, 0.6, "#6f9fdc", f"height {high:.1f}°"),
    ):
        start, end = 90.0 - angle / 2.0, 90.0 + angle / 2.0
        axes.add_patch(Wedge((0, 0), reach, start, end, fc=shade, ec="white", label=label))
    axes.plot([0], [0], marker="o", color="0.15", ms=5)
    lowest = min(0.0, float(np.cos(np.radians(min(diagonal, 360.0) / 2.0)))) - 0.08
    axes.set(xlim=(-1.05, 1.05), ylim=(lowest - 0.35, 1.05), aspect="equal")
    axes.set_axis_off()
    pixels = "{} x {} pixels".format(*camera.resolution)
    axes.set_title(f"{camera.projection}, {pixels}", fontsize=9)
    axes.legend(frameon=False, fontsize=9, loc="lower center", ncols=3, handlelength=1.0,
                columnspacing=1.0)  # fmt: skip


def _footprints(axes: Axes, camera: CameraModel) -> None:
    shades = ("#dbe7f7", "#a9c6ec", "#6f9fdc")
    for distance, shade in zip(DISTANCES, shades, strict=True):
        border = footprint(camera, distance)
        width, height = footprint_size(camera, distance)
        label = f"{distance:g} mm: {width:.3g} x {height:.3g}"
        axes.fill(border[:, 0], border[:, 1], fc=shade, ec="0.3", lw=0.8, label=label)
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel("mm")
    axes.tick_params(labelsize=8)
    axes.spines[["top", "right"]].set_visible(False)
    cut = max(camera.angles()) / 2.0 > STEEPEST
    title = "width x height seen of a plane, by its distance"
    axes.set_title(title + (f" (up to {STEEPEST:g}°)" if cut else ""), fontsize=9)
    axes.legend(frameon=False, fontsize=8, loc="upper center", bbox_to_anchor=(0.48, -0.17),
                ncols=3, handlelength=1.0, handletextpad=0.4, columnspacing=0.9)  # fmt: skip
