"""Figures of tasks. Matplotlib is imported when a figure is drawn; none is shown or saved."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from optisense.array_types import FloatArray
from optisense.figures import BLUE, RED, new_figure
from optisense.tasks._perception import PerceptionResult
from optisense.tasks._reconstruction import ReconstructionResult

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WORST_ANGLE = 30.0
"""Error of a normal (degrees) at the end of the colour scale, larger than the mean error of a flat
reading (about 20 degrees)."""


def draw_perception(result: PerceptionResult) -> Figure:
    """Draw predicted against true targets, each predicted by a forest that was not fitted to it."""
    targets, read = result.samples.targets, result.reading.predictions
    figure = new_figure(1.2 + 4.2 * targets.shape[1], 4.8)
    for number, axes in enumerate(figure.subplots(1, targets.shape[1], squeeze=False)[0]):
        ends = [targets[:, number].min(), targets[:, number].max()]
        axes.plot(ends, ends, color=RED, lw=1)
        axes.plot(targets[:, number], read[:, number], "o", ms=3, color=BLUE, alpha=0.7)
        error = np.abs(read - targets)[:, number].mean()
        name = result.targets[number].replace("_", " ")
        axes.set_title(f"{name}: mean error {error:.2g} {result.unit}", fontsize=10)
        axes.set_xlabel(f"true ({result.unit})")
        axes.set_ylabel(f"read ({result.unit})")
        axes.set_aspect("equal")
    figure.suptitle(
        f"{result.task} on {result.design}\n{len(targets)} contacts, "
        f"signal to noise {result.snr:.3g}",
        fontsize=11,
    )
    return figure


def draw_reconstruction(result: ReconstructionResult, axes: FloatArray) -> Figure:
    """Draw for each object the picture, true and read normals, their angle, and true and read
    depth. The axes (3, 3) are image right, image up and viewing direction, in the design's frame.
    """
    rows = len(result.objects)
    titles = ("picture", "true normals", "read normals", "normal error (°)")
    figure = new_figure(16, 2.15 * rows + 0.6)
    grid = figure.subplots(rows, 6, squeeze=False)
    for line, (name, each) in zip(grid, result.objects.items(), strict=True):
        deepest = float(np.nanmax(each.true_depth[each.mask]))
        pictures: tuple[tuple[NDArray[Any], dict[str, Any]], ...] = (
            (each.picture, {}),
            (_normal_colours(each.true_normals, axes), {}),
            (_normal_colours(each.normals, axes), {}),
            (each.angles, {"vmin": 0, "vmax": WORST_ANGLE, "cmap": "magma"}),
            (each.true_depth, {"vmin": 0, "vmax": deepest, "cmap": "viridis"}),
            (each.depth, {"vmin": 0, "vmax": deepest, "cmap": "viridis"}),
        )
        for cell, (values, colours) in zip(line, pictures, strict=True):
            shown = cell.imshow(values, **colours)
            cell.set_xticks([])
            cell.set_yticks([])
            if colours:
                figure.colorbar(shown, ax=cell, shrink=0.8)
        line[0].set_ylabel(name)
        ring = "" if np.isnan(each.ring_normal_error) else f", {each.ring_normal_error:.1f}° beside"
        line[3].set_xlabel(f"{each.normal_error:.1f}° in the contact{ring}")
        line[5].set_xlabel(f"error {each.depth_error:.3f} mm in the contact")
    for cell, title in zip(grid[0], (*titles, "true depth (mm)", "read depth (mm)"), strict=True):
        cell.set_title(title, fontsize=10)
    figure.suptitle(
        f"{result.design}, {result.settings.method} fitted to {result.settings.presses} presses "
        f"of a ball of {result.settings.radius:g} mm",
        fontsize=11,
    )
    return figure


def _normal_colours(normals: FloatArray, axes: FloatArray) -> FloatArray:
    """Return the usual colours (0 to 1) of a normal map: red right, green up, blue towards the
    camera.
    """
    seen = np.nan_to_num(normals) @ (axes * np.array([[1.0], [1.0], [-1.0]])).T
    colours: FloatArray = np.clip(0.5 + 0.5 * seen, 0.0, 1.0)
    return colours
