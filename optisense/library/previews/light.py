"""Preview of a light: its intensity by angle, and its package and window to scale."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from optisense.design.emitters import LightModel
from optisense.design.emitters.base import DARK
from optisense.library._entries import LightEntry, TypicalLight

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LEGEND_COLOURS = 4
"""Largest number of colours that the legend names; more do not fit beside the curves."""


def equivalent_solid_angle(emitter: LightModel) -> float:
    """Return the solid angle (sr) of a light: its flux divided by its largest intensity."""
    edges = np.linspace(0.0, 180.0, 3601)
    middle = 0.5 * (edges[1:] + edges[:-1])
    turns = np.arange(72) * 5.0
    mean = emitter.relative_intensity(middle[:, None], turns[None, :]).mean(axis=1)
    return float(2.0 * np.pi * (mean * -np.diff(np.cos(np.radians(edges)))).sum())


def draw_light(figure: Figure, entry: LightEntry) -> None:
    """Draw both pictures into a figure."""
    polar: Any = figure.add_axes((0.05, -0.08, 0.50, 1.00), projection="polar")
    figure.text(0.30, 0.85, _intensity(polar, entry), fontsize=9, ha="center", va="top")
    colours = "\n".join(colour_facts(entry))
    figure.text(0.30, 0.02, colours, fontsize=8.5, ha="center", va="bottom", linespacing=1.4)
    _front(figure.add_axes((0.64, 0.14, 0.33, 0.62)), entry)


def _intensity(axes: Any, entry: LightEntry) -> str:
    """Draw the intensity by angle, and return the text above it."""
    emitter: LightModel = entry.value
    axes.set_theta_zero_location("N")
    axes.set_theta_direction(-1)
    widest = 180.0 if emitter.relative_intensity([95.0, 120.0, 150.0]).max() > DARK else 90.0
    axes.set(thetamin=-widest, thetamax=widest)
    angle = np.linspace(-widest, widest, 1441)
    azimuths = [0.0, 90.0]
    planes = [
        emitter.relative_intensity(abs(angle), np.where(angle < 0, plane + 180.0, plane))
        for plane in azimuths
    ]
    round_beam = np.allclose(planes[0], planes[1], atol=1e-3)
    axes.plot(np.radians(angle), planes[0], color="0.15", lw=1.6)
    axes.fill(np.radians(angle), planes[0], color="#f5d76e", alpha=0.55, lw=0)
    if not round_beam:
        axes.plot(np.radians(angle), planes[1], color="0.15", lw=1.2, ls="--")
    axes.set_rmax(1.05)
    axes.set_yticks([0.25, 0.5, 0.75, 1.0])
    axes.set_yticklabels([])
    axes.tick_params(labelsize=8)
    facts = f"intensity by angle; half of it at {emitter.half_angle():.3g}°"
    if not round_beam:
        facts += f" (dashed: across, {emitter.half_angle(90.0):.3g}°)"
    return facts


def colour_facts(entry: LightEntry) -> list[str]:
    """Return a line for each colour: wavelength, flux at its current, and its peak intensity."""
    solid_angle = equivalent_solid_angle(entry.value)
    return [
        ", ".join(_facts(name, colour, solid_angle))
        for name, colour in list(entry.typical.items())[:LEGEND_COLOURS]
    ]


def _facts(name: str, colour: TypicalLight, solid_angle: float) -> list[str]:
    facts = [name if colour.wavelength is None else f"{name} {colour.wavelength:g} nm"]
    if colour.flux is not None:
        at = "" if colour.current is None else f" at {colour.current:g} mA"
        facts += [f"{colour.flux:g} mW{at}", f"peak {colour.flux / solid_angle:.3g} mW/sr"]
    return facts


def _front(axes: Axes, entry: LightEntry) -> None:
    """Draw the package and its window seen from the front, in mm."""
    from matplotlib.patches import Ellipse, Rectangle

    emitter: LightModel = entry.value
    package, window, face = entry.package, entry.window, emitter.window()
    disc = window is not None and window[0] == window[1]
    if face is not None:
        window, disc = face.size, face.shape == "disc"
    extent = max([*(package[:2] if package else ()), *(window or ()), 1.0])
    if package is not None:
        corner = (-package[0] / 2, -package[1] / 2)
        axes.add_patch(Rectangle(corner, package[0], package[1], fc="0.9", ec="0.3", lw=1.2))
    if window is not None:
        style: dict[str, Any] = {"fc": "#f5d76e", "ec": "#b8860b", "lw": 1.2}
        if disc:
            axes.add_patch(Ellipse((0, 0), window[0], window[1], **style))
        else:
            corner = (-window[0] / 2, -window[1] / 2)
            axes.add_patch(Rectangle(corner, window[0], window[1], **style))
    else:
        axes.plot([0], [0], marker="o", color="#b8860b")
    reach = 0.62 * extent
    axes.set(xlim=(-reach, reach), ylim=(-reach, reach), aspect="equal", xlabel="mm")
    axes.tick_params(labelsize=8)
    axes.spines[["top", "right"]].set_visible(False)
    lines = []
    if package is not None:
        lines.append("package " + " x ".join(f"{length:g}" for length in package) + " mm")
    if window is not None:
        size = f"{window[0]:g}" if disc else f"{window[0]:g} x {window[1]:g}"
        kind = "window" if face is not None else "simulated as a point; lens"
        lines.append(f"{kind} {size} mm" + (" across" if disc else ""))
    axes.set_title("\n".join(lines) or "a point", fontsize=9)
