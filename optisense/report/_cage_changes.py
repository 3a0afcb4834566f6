"""Changes of a cage by a search: its moved control points, drawn on the part that they deform."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from optisense.array_types import FloatArray
from optisense.design import SensorDesign
from optisense.design.section import cut
from optisense.figures import BLUE, GREY, PALE, RED, new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

STILL = 1e-6
"""Largest displacement of a control point that is unmoved, mm; a blend's rounding is below."""

MOST_LAYERS = 4
"""Largest number of panels of a figure: the layers of the lattice whose points moved farthest."""

MOST_NUMBERS = 30
"""Largest number of numbered points in a panel: of a finer lattice those that moved farthest, as
overlapping numbers can't be read.
"""

INSIDE = 0.02
"""Distance by which the outermost layers of a lattice are cut inside its box, as a share of the
box's size; the layers lie on the box, where the part ends.
"""

AXES = "xyz"


@dataclass(frozen=True)
class CageChange:
    """Control points of one cage before and after.

    Attributes:
        name: name of the cage.
        before, after: control points (n, 3) in their order, mm.
        resolution: number of points of the lattice along x, y, z.
        box: box of the lattice at rest, (2, 3) mm.
        outlines: outlines of the deformed parts for each layer of the lattice, as polylines (k, 3)
            in mm, before and after.
        layered: axis (0 to 2) along which points moved least; layers are stacked along it.
    """

    name: str
    before: FloatArray
    after: FloatArray
    resolution: tuple[int, int, int]
    box: FloatArray
    outlines: tuple[tuple[list[FloatArray], list[FloatArray]], ...]
    layered: int

    @property
    def moves(self) -> FloatArray:
        """Displacements of the control points, (n, 3) mm."""
        return self.after - self.before

    @property
    def lengths(self) -> FloatArray:
        """Lengths of the displacements, (n,) mm."""
        return np.asarray(np.linalg.norm(self.moves, axis=1))

    def rows(self) -> list[list[str]]:
        """Return number, position before, displacement and length of each point, longest first."""
        return [
            [
                str(number),
                ", ".join(f"{value:.2f}" for value in self.before[number]),
                *(f"{value:+.2f}" for value in self.moves[number]),
                f"{self.lengths[number]:.2f}",
            ]
            for number in np.argsort(-self.lengths, kind="stable")
            if self.lengths[number] > STILL
        ]

    def summary(self) -> str:
        """Return a sentence on how many points moved, and how far."""
        moved = self.lengths[self.lengths > STILL]
        farthest = int(self.lengths.argmax())
        return (
            f"{len(moved)} of {len(self.lengths)} control points moved, by {np.median(moved):.2f} "
            f"mm in the median; point {farthest} moved farthest, by {self.lengths.max():.2f} mm."
        )


def cage_changes(before: SensorDesign, after: SensorDesign) -> list[CageChange]:
    """Return the cages whose control points differ between two designs."""
    found = []
    for name, cage in before.cages.items():
        if name not in after.cages or after.cages[name].resolution != cage.resolution:
            continue
        old, new = cage.current_points(), after.cages[name].current_points()
        if np.linalg.norm(new - old, axis=1).max() <= STILL:
            continue
        layered = int(((new - old) ** 2).sum(axis=0).argmin())
        box = np.array(cage.box, dtype=np.float64)
        outlines = tuple(
            (_outlines(before, cage.parts, place), _outlines(after, cage.parts, place))
            for place in _layers(box, cage.resolution, layered)
        )
        found.append(CageChange(name, old, new, cage.resolution, box, outlines, layered))
    return found


def cage_figure(change: CageChange) -> Figure:
    """Draw the control points layer by layer, with numbers and arrows from before to after."""
    count = change.resolution[change.layered]
    grid = np.moveaxis(np.arange(len(change.before)).reshape(change.resolution), change.layered, 0)
    spans = np.delete(np.ptp(np.vstack([change.before, change.after]), axis=0), change.layered)
    flat = [axis for axis in range(3) if axis != change.layered]
    across, up = flat if spans[0] >= spans[1] else flat[::-1]
    farthest = [change.lengths[grid[layer]].max() for layer in range(count)]
    shown = sorted(np.argsort(farthest)[::-1][:MOST_LAYERS].tolist())
    ratio = float(spans.min() / max(spans.max(), 1e-9))
    figure = new_figure(9.5, len(shown) * float(np.clip(8.6 * ratio, 1.6, 6.0)) + 0.9)
    panels = figure.subplots(len(shown), 1, squeeze=False, sharex=True, sharey=True)[:, 0]
    for axes, layer in zip(panels, shown, strict=True):
        _layer(axes, change, grid[layer], layer, (across, up))
        low, high = change.box[:, change.layered]
        place = low + layer / (count - 1) * (high - low)
        axes.set_title(f"layer at {AXES[change.layered]} = {place:.4g} mm", fontsize=9, loc="left")
        axes.set_ylabel(f"{AXES[up]}, mm", fontsize=9)
    panels[-1].set_xlabel(f"{AXES[across]}, mm", fontsize=9)
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, fontsize=8, ncols=len(handles), loc="outside lower center")
    return figure


def _layer(
    axes: Axes, change: CageChange, numbers: NDArray[np.int64], layer: int, plane: tuple[int, int]
) -> None:
    """Draw one layer (a, b) of the lattice in the plane of two axes."""
    chosen = list(plane)
    before, after = change.before[:, chosen], change.after[:, chosen]
    for lines in (numbers, numbers.T):
        for line in lines:
            axes.plot(*before[line].T, color=PALE, lw=0.8, zorder=1)
    for drawn, colour, style, label in zip(
        change.outlines[layer], (GREY, BLUE), ("--", "-"), ("shape before", "after"), strict=True
    ):
        for number, outline in enumerate(drawn):
            axes.plot(
                *outline[:, chosen].T,
                color=colour,
                ls=style,
                lw=1.6,
                label=label if number == 0 else None,
                zorder=2,
            )
    every = numbers.ravel()
    moved = every[change.lengths[every] > STILL]
    axes.plot(*before[every].T, "o", color=GREY, ms=3.5, zorder=3, ls="", label="control point")
    steps = after[moved] - before[moved]
    axes.quiver(
        *before[moved].T,
        *steps.T,
        angles="xy",
        scale_units="xy",
        scale=1.0,
        color=RED,
        width=0.0022,
        zorder=4,
        label="its displacement",
    )
    axes.plot(*after[every].T, " ")  # arrows alone do not widen the limits of a panel
    numbered = moved[np.argsort(-change.lengths[moved])][:MOST_NUMBERS]
    for rank, number in enumerate(numbered[np.lexsort(after[numbered].T)]):
        # Labels are at the arrows' tips, where points are farther apart; those of neighbours
        # alternate.
        right = rank % 2 == 0
        axes.annotate(
            str(number),
            after[number],
            (5 if right else -5, 0),
            textcoords="offset points",
            ha="left" if right else "right",
            va="center",
            fontsize=8,
            zorder=5,
        )
    axes.set_aspect("equal")
    axes.margins(0.06)
    axes.tick_params(labelsize=8)
    axes.grid(alpha=0.15)


def _layers(box: FloatArray, resolution: tuple[int, int, int], axis: int) -> list[FloatArray]:
    """Return a point and a normal, (2, 3), of the plane of each layer, slightly inside the box."""
    low, high = box[:, axis]
    inset = INSIDE * (high - low)
    found = []
    for height in np.linspace(low, high, resolution[axis]):
        origin = np.zeros(3)
        origin[axis] = np.clip(height, low + inset, high - inset)
        found.append(np.stack([origin, np.eye(3)[axis]]))
    return found


def _outlines(design: SensorDesign, parts: list[str], plane: FloatArray) -> list[FloatArray]:
    """Return polylines (k, 3) of the intersections of a plane with the parts of a cage."""
    meshes = design.deformed_meshes()
    return [line for name in parts if name in meshes for line in cut(meshes[name], *plane)]
