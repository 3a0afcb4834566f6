"""Figures of scores. Matplotlib is imported when a figure is drawn; none is shown or saved."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from optisense.figures import BLUE, RED, new_figure

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from optisense.objectives.score import Score


def _square_grid(
    count: int, width: float, height: float, *, sharey: bool = False, beside: float = 0.0
) -> tuple[Figure, NDArray[np.object_]]:
    """Return a figure with a square grid of axes (rows, columns) for at least ``count`` drawings.

    ``width`` and ``height`` are the size of a drawing, and ``beside`` the room beside the grid, in
    inches; unused axes are hidden.
    """
    across = int(np.ceil(count**0.5))
    down = -(-count // across)
    figure = new_figure(width * across + beside, height * down)
    grid = figure.subplots(down, across, squeeze=False, sharey=sharey)
    for axes in grid.ravel()[count:]:
        axes.set_axis_off()
    return figure, grid


def _as_in_the_picture(middles: Sequence[tuple[float, float]], across: int) -> list[int]:
    """Return the order in which drawings of contacts fill the rows of a grid, so that they lie as
    the contacts do in the picture.

    Args:
        middles: row and column of the middle of each contact in the picture, pixels.
        across: number of drawings in a row of the grid.
    """
    down = sorted(range(len(middles)), key=lambda number: middles[number][0])
    rows = [down[start : start + across] for start in range(0, len(down), across)]
    return [number for row in rows for number in sorted(row, key=lambda each: middles[each][1])]


def draw_failure(score: Score) -> Figure:
    """Draw the reason why there is no score."""
    figure = new_figure(6, 1.2)
    figure.text(
        0.5, 0.5, f"{score.name} failed: {score.failure}", ha="center", va="center", wrap=True
    )
    return figure


def draw_parts(score: Score) -> Figure:
    """Draw a bar for each number among the parts, for objectives without a figure of their own."""
    numbers = {"value": score.value} | {
        key: float(value)
        for key, value in score.parts.items()
        if isinstance(value, int | float) and not isinstance(value, bool)
    }
    figure = new_figure(6, 0.8 + 0.4 * len(numbers))
    axes = figure.subplots()
    bars = axes.barh(list(numbers), list(numbers.values()), color=BLUE)
    axes.bar_label(bars, fmt="%.4g", padding=3)
    axes.invert_yaxis()
    axes.margins(x=0.15)
    axes.set_title(score.name)
    return figure


def draw_rgb2normal(score: Score) -> Figure:
    """Draw dominant colour against angle with the fitted lines, and R² by place and direction."""
    places = score.parts["places"]
    values = np.array([place["score"] for place in places])
    typical = int(np.argsort(values)[len(values) // 2])
    lines = score.arrays["lines"][typical]
    columns = min(4, len(lines))
    rows = -(-len(lines) // columns)
    figure = new_figure(12, 2.9 * rows + 2.6)
    upper, lower = figure.subfigures(2, 1, squeeze=False, height_ratios=[2.9 * rows, 2.6])[:, 0]
    grid = upper.subplots(rows, columns, sharex=True, squeeze=False).ravel()
    for axes, (angle, fit) in zip(grid, lines.items(), strict=False):
        axes.plot(fit.angles, fit.colours, "o", ms=3, color=BLUE)
        ends = np.array([fit.angles.min(), fit.angles.max()])
        axes.plot(ends, fit.intercept + fit.slope * ends, color=RED, lw=1.2)
        axes.set_title(f"{angle:g}°: R² = {fit.linearity:.3f}", fontsize=10)
        axes.set_xlabel("signed angle of the normal (°)")
    grid[0].set_ylabel("dominant colour")
    upper.suptitle(f"place {typical + 1}, which scores {values[typical]:.3f}", fontsize=11)
    axes = lower.subplots()
    table = np.array([list(place["directions"].values()) for place in places])
    shown = axes.imshow(table.T, cmap="viridis", vmin=0, vmax=1, aspect="auto")
    axes.set_yticks(range(table.shape[1]), [f"{a}°" for a in places[0]["directions"]])
    axes.set_xticks(range(len(places)), [f"{i + 1}\n{value:.3f}" for i, value in enumerate(values)])
    axes.set_xlabel("place and its score")
    axes.set_ylabel("direction")
    figure.colorbar(shown, ax=axes, label="R²")
    return figure


def draw_normdiff(score: Score) -> Figure:
    """Draw confusion over the sphere of normals, seen from above, and its two parts."""
    table = {key: np.asarray(value) for key, value in score.parts["confusion_map"].items()}
    figure = new_figure(12, 4.2)
    titles = {
        "confusion": "confusion (°)",
        "theta_range": "range of polar angles (°)",
        "phi_range": "range of azimuths on the sphere (°)",
    }
    grid = figure.subplots(1, 3, subplot_kw={"projection": "polar"})
    for axes, (key, title) in zip(grid, titles.items(), strict=True):
        shown = axes.scatter(
            np.radians(table["phi"]), table["theta"], c=table[key], s=16, cmap="magma_r", vmin=0
        )
        axes.set_title(title, fontsize=10)
        axes.set_ylim(0, float(table["theta"].max()) + 2)
        axes.set_rticks(np.arange(20, float(table["theta"].max()), 20))
        axes.tick_params(labelsize=8)
        figure.colorbar(shown, ax=axes, shrink=0.7)
    figure.suptitle("by true normal: polar angle outward, azimuth from east", fontsize=10)
    return figure


def draw_aoap(score: Score) -> Figure:
    """Draw the cosine between each pixel's ray and the surface normal."""
    cosine = np.where(score.arrays["hit"], score.arrays["cosine"], np.nan)
    figure = new_figure(9, 4.2)
    picture, histogram = figure.subplots(1, 2, width_ratios=[2, 1])
    degrees = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
    seen = degrees[np.isfinite(degrees)]
    most = 10.0 * float(np.ceil(seen.max() / 10))
    _map(figure, picture, degrees, "angle of incidence (°)", 0.0, most)
    histogram.hist(seen, bins=40, range=(0, most), weights=np.full(len(seen), 100 / degrees.size))
    histogram.set_xlabel("angle of incidence (°)")
    histogram.set_ylabel("pixels (%)")
    histogram.set_title(f"coverage {100 * score.parts['coverage']:.1f} %", fontsize=10)
    return figure


def draw_projection_warping(score: Score) -> Figure:
    """Draw the area of the surface that each pixel sees, relative to the mean."""
    areas = score.arrays["areas"]
    known = np.isfinite(areas)
    count = known.sum(axis=2)
    total = np.where(known, areas, 0).sum(axis=2)
    mean = np.divide(total, count, out=np.full(total.shape, np.nan), where=count > 0)
    relative = mean / score.parts["mean_area"]
    figure = new_figure(9, 4.2)
    picture, histogram = figure.subplots(1, 2, width_ratios=[2, 1])
    low, high = (float(x) for x in np.nanpercentile(relative, (1, 99)))
    limits = min(low, 0.9), max(high, 1.1)
    _map(figure, picture, relative, "area over mean", *limits)
    histogram.hist(areas[known] / score.parts["mean_area"], bins=50, range=limits, color=BLUE)
    histogram.set_xlabel("area over mean")
    histogram.set_ylabel("triangles")
    return figure


def draw_shadow(score: Score) -> Figure:
    """Draw the skin that loses red, green or blue light, in that colour, for each place."""
    maps, places = score.arrays["maps"], score.parts["places"]
    figure, grid = _square_grid(len(maps), 2.4, 2.1)
    for number, (axes, lost) in enumerate(zip(grid.ravel(), maps, strict=False)):
        taken = np.nan_to_num(lost)
        none = ~taken.any(axis=2, keepdims=True)
        shown = np.where(np.isnan(lost), 0.55, np.where(none, 0.92, 0.85 * taken))
        axes.imshow(shown)
        axes.set_title(f"{number + 1}: {100 * places[number]['share']:.1f} %", fontsize=10)
        axes.set_xticks([])
        axes.set_yticks([])
    figure.suptitle("place and the share of the skin that loses the colours shown", fontsize=11)
    return figure


def draw_depth(score: Score) -> Figure:
    """Draw the true and the read depth along a row of each contact, at its place in the picture."""
    profiles, places = score.arrays["profiles"], score.parts["places"]
    figure, grid = _square_grid(len(profiles), 2.6, 1.9, sharey=True)
    order = _as_in_the_picture([each["middle"] for each in profiles], grid.shape[1])
    for cell, (axes, number) in enumerate(zip(grid.ravel(), order, strict=False)):
        each = profiles[number]
        axes.plot(each["true"], color="#888888", lw=2.5, label="true")
        axes.plot(each["read"], color=RED, lw=1.2, label="read")
        axes.set_title(f"{number + 1}: {places[number]['error']:.3f} mm", fontsize=10)
        axes.set_xticks([])
        if cell % grid.shape[1] == 0:
            axes.set_ylabel("depth (mm)")
    grid[0, 0].invert_yaxis()
    grid[0, 0].legend(fontsize=8, frameon=False)
    figure.suptitle("place and the mean error over its contact; along its middle row", fontsize=11)
    return figure


def draw_coverage(score: Score) -> Figure:
    """Draw the pixels that see the sensing surface, and the share of the surface that they see."""
    hit = score.arrays["hit"]
    figure = new_figure(9, 4.2)
    picture, shares = figure.subplots(1, 2, width_ratios=[2, 1])
    picture.imshow(hit, cmap="Blues_r", vmin=0, vmax=1.4, interpolation="nearest")
    picture.set_xticks([])
    picture.set_yticks([])
    picture.set_xlabel("light: the surface is seen; dark: it is not", fontsize=9)
    names = ("area of\nthe surface", "triangles of\nthe surface", "pixels of\nthe picture")
    parts = score.parts
    values = (score.value, parts["by_triangles"], parts["pixels_that_see_the_surface"])
    bars = shares.bar(names, [100 * value for value in values], color=BLUE)
    shares.bar_label(bars, fmt="%.1f %%", padding=2)
    shares.set_ylim(0, 110)
    shares.set_ylabel("seen (%)")
    shares.tick_params(labelsize=8)
    return figure


def draw_sharpness(score: Score) -> Figure:
    """Draw the width of the finest line that is resolved at each pixel."""
    title = f"mean over the skin {score.value:.3g} mm"
    return _map_and_histogram(
        score, score.arrays["detail"], "width of the finest line (mm)", "pixels (%)", title
    )


def draw_distortion(score: Score) -> Figure:
    """Draw the ratio of length to width of the footprint of each pixel."""
    title = f"geometric mean {score.value:.3g}"
    label = "length over width of a footprint"
    values = score.arrays["anisotropy"]
    return _map_and_histogram(score, values, label, "footprints (%)", title, low=1.0, least=1.5)


def _map_and_histogram(
    score: Score,
    values: Any,
    label: str,
    counted: str,
    title: str,
    *,
    low: float = 0.0,
    least: float = 0.0,
) -> Figure:
    """Draw a map (h, w) of values and their histogram, with a line at the score.

    The upper end of the scale is the 99th percentile, but at least `least`.
    """
    known = values[np.isfinite(values)]
    figure = new_figure(9, 4.2)
    picture, histogram = figure.subplots(1, 2, width_ratios=[2, 1])
    most = max(least, float(np.percentile(known, 99)))
    _map(figure, picture, values, label, low, most)
    weights = np.full(len(known), 100 / len(known))
    histogram.hist(np.clip(known, low, most), bins=50, range=(low, most), weights=weights)
    histogram.axvline(score.value, color=RED, lw=1.2)
    histogram.set_xlabel(label)
    histogram.set_ylabel(counted)
    histogram.set_title(title, fontsize=10)
    return figure


def draw_reading(score: Score) -> Figure:
    """Draw the error of the reading in each contact, at its place in the picture."""
    maps, places = score.arrays["maps"], score.parts["places"]
    figure, grid = _square_grid(len(maps), 2.2, 2.3, beside=0.8)
    seen = np.concatenate([each["errors"][np.isfinite(each["errors"])] for each in maps])
    most = max(1.0, float(np.percentile(seen, 98)))
    order = _as_in_the_picture([each["middle"] for each in maps], grid.shape[1])
    for axes, number in zip(grid.ravel(), order, strict=False):
        axes.set_facecolor("#888888")
        shown = axes.imshow(maps[number]["errors"], cmap="magma", vmin=0.0, vmax=most)
        axes.set_title(f"{number + 1}: {places[number]['error']:.1f}°", fontsize=10)
        axes.set_xticks([])
        axes.set_yticks([])
    figure.colorbar(shown, ax=list(grid.ravel()), label="error of the normal (°)", shrink=0.8)
    figure.suptitle("place and the mean over its contact", fontsize=11)
    return figure


def _map(
    figure: Figure, axes: Axes, values: Any, label: str, lowest: float, highest: float
) -> None:
    axes.set_facecolor("#888888")
    shown = axes.imshow(values, cmap="viridis", vmin=lowest, vmax=highest)
    axes.set_xticks([])
    axes.set_yticks([])
    if not np.isfinite(values).all():
        axes.set_xlabel("grey: left out, or the surface is not seen", fontsize=9)
    figure.colorbar(shown, ax=axes, label=label, shrink=0.8)
