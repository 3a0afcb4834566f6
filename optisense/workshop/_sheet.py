"""Sheet of a drawing, as SVG in mm: lines, texts, arrows and dimensions."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from optisense.array_types import FloatArray
from optisense.text import to_html

TEXT = 2.5
"""Height of letters, mm: the smallest of ISO 3098 that is read easily."""

ARROW = 2.0
"""Length of an arrow of a dimension, mm, a little less than the height of the letters beside it."""

FONT = 1.4 * TEXT
"""Size of the font, mm, whose digits are nearly as high as `TEXT`."""

LETTER = 0.64 * FONT
"""Width of a digit, mm, in wide fonts such as DejaVu Sans; the mean of words is less."""

STYLE = (
    ".edge{fill:none;stroke:#000;stroke-width:.35}"
    ".hidden{fill:none;stroke:#000;stroke-width:.25;stroke-dasharray:1.5 .8}"
    ".thin{fill:none;stroke:#000;stroke-width:.13}.arrow{fill:#000}"
    f"text{{font:{FONT:.2f}px sans-serif}}"
)


@dataclass
class DrawingSheet:
    """Elements of the drawing, in mm with y up; SVG has y down."""

    height: float
    lines: list[str] = field(default_factory=list)

    def at(self, point: FloatArray | tuple[float, float]) -> str:
        """Return a point (x, y), mm, as SVG writes it."""
        return f"{point[0]:.4f} {self.height - point[1]:.4f}"

    def path(self, moves: str, kind: str) -> None:
        """Add a path; `kind` is one of the classes of `STYLE`."""
        self.lines.append(f'<path class="{kind}" d="{moves}"/>')

    def line(self, start: tuple[float, float], end: tuple[float, float], kind: str) -> None:
        """Add a straight line between two points, mm; `kind` is one of the classes of `STYLE`."""
        self.path(f"M {self.at(start)} L {self.at(end)}", kind)

    def text(
        self, at: tuple[float, float], words: str, anchor: str = "middle", upright: bool = False
    ) -> None:
        """Add text at a point, mm; `anchor` is SVG's, and upright text runs upwards."""
        x, y = at[0], self.height - at[1]
        turn = f' transform="rotate(-90 {x:.3f} {y:.3f})"' if upright else ""
        self.lines.append(
            f'<text x="{x:.3f}" y="{y:.3f}" text-anchor="{anchor}"{turn}>{to_html(words)}</text>'
        )

    def arrow(self, tip: tuple[float, float], way: tuple[float, float]) -> None:
        """Draw a full arrowhead at a tip; `way` is a unit vector along it."""
        back = np.array(tip) - ARROW * np.array(way)
        across = 0.17 * ARROW * np.array([-way[1], way[0]])
        moves = f"M {self.at(tip)} L {self.at(back + across)} L {self.at(back - across)} Z"
        self.path(moves, "arrow")

    def across(self, x0: float, x1: float, foot: float, y: float) -> None:
        """Draw a dimension along x, below or above the edge at `foot`."""
        for x in (x0, x1):
            self.line((x, foot), (x, y + np.sign(y - foot)), "thin")
        self.line((x0, y), (x1, y), "thin")
        self._arrows((x0, y), (x1, y), (1.0, 0.0))
        self.text((0.5 * (x0 + x1), y + 0.7), number(x1 - x0))

    def up(self, y0: float, y1: float, foot: float, x: float) -> None:
        """Draw a dimension along y, beside the edge at `foot`."""
        for y in (y0, y1):
            self.line((foot, y), (x + np.sign(x - foot), y), "thin")
        self.line((x, y0), (x, y1), "thin")
        self._arrows((x, y0), (x, y1), (0.0, 1.0))
        if y1 - y0 > 4.0 * TEXT:
            self.text((x - 0.7, 0.5 * (y0 + y1)), number(y1 - y0), upright=True)
        else:
            self.text((x - 0.7, 0.5 * (y0 + y1 - TEXT)), number(y1 - y0), "end")

    def _arrows(
        self, start: tuple[float, float], end: tuple[float, float], way: tuple[float, float]
    ) -> None:
        """Draw arrows inside the dimension if there is room, else from outside."""
        inside = abs(end[0] - start[0]) + abs(end[1] - start[1]) > 3.0 * ARROW
        sign = 1.0 if inside else -1.0
        ahead, behind = (sign * way[0], sign * way[1]), (-sign * way[0], -sign * way[1])
        self.arrow(end, ahead)
        self.arrow(start, behind)
        if not inside:
            for (x, y), (dx, dy) in ((end, behind), (start, ahead)):
                tail = x - 2.0 * ARROW * -dx, y - 2.0 * ARROW * -dy
                self.line((x, y), tail, "thin")

    def ordinates(
        self, values: list[float], foot: tuple[float, float], corner: FloatArray, axis: int
    ) -> None:
        """Write distances from a corner, one beside each place on an edge, along x (0) or y (1).

        Args:
            values: distances along the axis, ascending, mm.
            foot: across the axis, where lines begin and where they end, mm.
            corner: corner (2,) of the plate on the sheet, mm.
        """
        begin, end = foot
        for value, moved in zip(values, apart(values), strict=True):
            place, shown = (float(corner[axis]) + each for each in (value, moved))
            if axis == 0:
                self.line((place, begin), (shown, end), "thin")
                self.text((shown + 0.4 * TEXT, end - 0.5), number(value), "end", upright=True)
            else:
                self.line((begin, place), (end, shown), "thin")
                self.text((end + 0.5, shown - 0.4 * TEXT), number(value), "start")


def apart(values: list[float]) -> list[float]:
    """Return ascending places, mm, of which those that are closer than a line of text are moved
    up.
    """
    found: list[float] = []
    for value in values:
        found.append(max(value, found[-1] + 1.2 * TEXT) if found else value)
    return found


def number(value: float) -> str:
    """Format a length in mm, to a hundredth."""
    return f"{value:.2f}".rstrip("0").rstrip(".")
