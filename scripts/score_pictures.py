"""Make the pictures of docs/objectives.md anew: python scripts/score_pictures.py"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import optisense as ots
from optisense.objectives import Evaluation, Press
from optisense.objectives.rgb2normal import fit, line, signed_angles

OUT = Path(__file__).parent.parent / "docs" / "images"
LINES = ((5, 90.0), (2, 0.0))
"""Place and direction (degrees) of a good line and of a poor one."""
CURVED = "gelsight-svelte"
DOTS_PER_INCH = 80
"""Resolution of the pictures, dots per inch, with which they are some 1,000 pixels wide."""


def straight_and_bent(evaluation: Evaluation) -> None:
    """Draw two lines through pressed balls: their place, the colours on them, and the fits."""
    figure = Figure(figsize=(12.0, 6.4), facecolor="white", layout="constrained")
    for row, (place, angle) in zip(figure.subplots(2, 3), LINES, strict=True):
        press = evaluation.presses[place - 1]
        chosen = line(press, angle)
        angles = signed_angles(press, angle, press.normals[chosen])
        colours = press.colours(chosen)
        fitted = fit(angles, colours)
        row[0].imshow(_picture(press))
        box = _box(press)
        rows, columns = np.nonzero(chosen)
        row[0].plot(columns - box[1].start, rows - box[0].start, ".", ms=1.5, color="white")
        row[0].set_title(f"place {place}, direction {angle:g}°", fontsize=10)
        row[0].set_axis_off()
        for channel, name in enumerate(("red", "green", "blue")):
            row[1].plot(angles, 255 * colours[:, channel], ".", ms=4, color=f"tab:{name}")
        row[1].set_ylim(0, 255)
        row[1].set_title("colours on the line", fontsize=10)
        row[1].set_ylabel("grey level")
        row[2].plot(fitted.angles, 255 * fitted.colours, ".", ms=4, color="#334155")
        ends = np.array([angles.min(), angles.max()])
        row[2].plot(ends, 255 * (fitted.intercept + fitted.slope * ends), color="#c0392b", lw=1.2)
        row[2].set_ylim(-170, 170)
        row[2].set_title(f"dominant colour: R² = {fitted.linearity:.3f}", fontsize=10)
        for axes in row[1:]:
            axes.set_xlabel("angle of the surface along the line (°)")
    _save(figure, "score-rgb2normal")


def _box(press: Press, margin: int = 40) -> tuple[slice, slice]:
    rows, columns = press.box
    return (
        slice(max(0, rows.start - margin), rows.stop + margin),
        slice(max(0, columns.start - margin), columns.stop + margin),
    )


def _picture(press: Press) -> np.ndarray:
    box = _box(press)
    everywhere = np.ones_like(press.mask)
    return press.colours(everywhere).reshape(*press.mask.shape, 3)[box]


def _save(figure: Figure, name: str) -> None:
    figure.savefig(OUT / f"{name}.png", dpi=DOTS_PER_INCH)
    print(OUT / f"{name}.png")


def main() -> None:
    """Make all pictures."""
    OUT.mkdir(parents=True, exist_ok=True)
    evaluation = Evaluation(ots.OpticalModel(ots.load("gelsight-mini-ideal")))
    straight_and_bent(evaluation)
    for name in ("normdiff", "reading"):
        _save(ots.evaluate(evaluation, name).figure(), f"score-{name}")
    curved = Evaluation(ots.OpticalModel(ots.load(CURVED)))
    for name in ("aoap", "2to3pw"):
        _save(ots.evaluate(curved, name).figure(), f"score-{name}")


if __name__ == "__main__":
    main()
