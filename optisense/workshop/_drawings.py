"""Drawings of plates: an outline to cut (DXF), and a sheet with three views and dimensions (SVG).

The plan is on top, the front view below it, and the left view beside it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
import shapely
from scipy.interpolate import CubicSpline

from optisense.array_types import FloatArray
from optisense.text import to_html
from optisense.workshop._dxf import Pair, arc, circle, dxf, line
from optisense.workshop._plates import Circle, Plate
from optisense.workshop._profiles import OutlinePiece, centre_of

GAP = 16.0
"""Distance between two views, mm: room for a dimension and its number."""

BORDER = 8.0
"""Margin around the drawing, mm; printers leave 4 to 6 mm of a sheet blank."""

OFF = 7.0
"""Distance between a view and the line of its dimension, mm: nearly half of `GAP`, so that the
number stands clear of both views."""

TEXT = 2.5
"""Height of letters, mm: the smallest of ISO 3098 that is read easily."""

ARROW = 2.0
"""Length of an arrow of a dimension, mm, a little less than the height of the letters beside it."""

STEPS_OF_CURVE = 4
"""Number of points for each corner of a curve in a DXF file, whose release 12 has no splines."""

SHARP = 20.0
"""Angle from which on a corner counts as an edge that is visible from the side, degrees."""

LEAST_TITLE = 90.0
"""Smallest width of the sheet, mm, which the lines of the title need."""

LEADER = 8.0
"""Length of the line from an arc to its radius, mm."""


def cut_file(plate: Plate) -> str:
    """Return the outline of a plate as a DXF drawing in mm, on the layer CUT."""
    entities: list[list[Pair]] = []
    for outline in plate.outlines:
        if isinstance(outline, Circle):
            entities.append(circle("CUT", outline.centre.tolist(), outline.radius))
            continue
        for piece in outline:
            entities += list(_cut(piece))
    return dxf(entities)


def _cut(piece: OutlinePiece) -> Iterator[list[Pair]]:
    """Yield the DXF entities of a piece of an outline."""
    if piece.kind == "line":
        yield line("CUT", *piece.points.tolist())
    elif piece.kind == "arc":
        centre = centre_of(*piece.points)
        assert centre is not None
        start, _, end = np.degrees(np.arctan2(*(piece.points - centre).T[::-1])).tolist()
        if not _is_anticlockwise(piece.points):
            start, end = end, start
        radius = float(np.linalg.norm(piece.points[0] - centre))
        yield arc("CUT", centre.tolist(), radius, start % 360.0, end % 360.0)
    else:
        points = _through(piece.points)
        for one, other in zip(points[:-1].tolist(), points[1:].tolist(), strict=True):
            yield line("CUT", one, other)


def _is_anticlockwise(points: FloatArray) -> bool:
    """Return whether an arc through three points (3, 2) turns anticlockwise."""
    (ax, ay), (bx, by) = points[1] - points[0], points[2] - points[1]
    return bool(ax * by - ay * bx > 0.0)


def _through(points: FloatArray) -> FloatArray:
    """Return points (k, 2) of a cubic spline through points (n, 2), mm."""
    lengths = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    shares = np.linspace(0.0, 1.0, STEPS_OF_CURVE + 1)[:-1]
    fine = np.concatenate([(lengths[:-1, None] + shares * np.diff(lengths)[:, None]).reshape(-1),
                           lengths[-1:]])  # fmt: skip
    return np.asarray(CubicSpline(lengths, points)(fine))


@dataclass
class _Sheet:
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


STYLE = (
    ".edge{fill:none;stroke:#000;stroke-width:.35}"
    ".hidden{fill:none;stroke:#000;stroke-width:.25;stroke-dasharray:1.5 .8}"
    ".thin{fill:none;stroke:#000;stroke-width:.13}.arrow{fill:#000}"
    f"text{{font:{TEXT * 1.4:.2f}px sans-serif}}"
)


def drawing(plate: Plate, title: str) -> str:
    """Return three views of a plate at 1:1 with its dimensions, as an SVG picture in mm."""
    ring = _polygon(plate)  # with its arcs, of which a mesh has only chords
    width, depth, thick = ring.bounds[2], ring.bounds[3], plate.thickness
    title_height = 8.0 * TEXT
    left, bottom = BORDER + OFF + TEXT, BORDER + title_height
    front = bottom + OFF
    plan = front + thick + GAP
    side = left + width + GAP
    whole = max(side + thick + OFF + BORDER + 2.0 * TEXT, LEAST_TITLE), plan + depth + BORDER + OFF
    sheet = _Sheet(whole[1])
    corner = np.array([left, plan])
    for outline in plate.outlines:
        _plan(sheet, outline, corner)
    _beside(sheet, ring, (left, front), thick, 0)
    _beside(sheet, ring, (side, plan), thick, 1)
    sheet.across(left, left + width, plan + depth, plan + depth + OFF)
    sheet.up(plan, plan + depth, left, left - OFF)
    sheet.up(front, front + thick, left, left - OFF)
    _round(sheet, plate, corner)
    of = f", {plate.material}" if plate.material else ""
    words = [
        f"{plate.name}: {plate.count} x {number(thick)} mm{of}",
        f"{title}; mm, 1:1",
        "plan; below: from the front; right: from the left",
    ]
    for row, text in enumerate(words):
        sheet.text((BORDER, BORDER + 2.2 * TEXT * (len(words) - 1 - row)), text, "start")
    size = f'width="{whole[0]:.2f}mm" height="{whole[1]:.2f}mm"'
    return "\n".join([
        f'<svg xmlns="http://www.w3.org/2000/svg" {size} viewBox="0 0 {whole[0]:.2f} '
        f'{whole[1]:.2f}">',
        f"<title>{to_html(plate.name)}</title><style>{STYLE}</style>",
        '<rect width="100%" height="100%" fill="#fff"/>',
        *sheet.lines,
        "</svg>",
        "",
    ])  # fmt: skip


def _plan(sheet: _Sheet, outline: Circle | list[OutlinePiece], corner: FloatArray) -> None:
    """Draw an outline in the plan."""
    if isinstance(outline, Circle):
        x, y = (outline.centre + corner).tolist()
        r = outline.radius
        half = f"A {r:.4f} {r:.4f} 0 1 0"
        sheet.path(
            f"M {sheet.at((x - r, y))} {half} {sheet.at((x + r, y))} "
            f"{half} {sheet.at((x - r, y))} Z",
            "edge",
        )
        return
    moves = [f"M {sheet.at(outline[0].points[0] + corner)}"]
    for piece in outline:
        points = piece.points + corner
        if piece.kind == "line":
            moves.append(f"L {sheet.at(points[1])}")
        elif piece.kind == "arc":
            centre = centre_of(*points)
            assert centre is not None
            radius = float(np.linalg.norm(points[0] - centre))
            turns = _is_anticlockwise(points)
            a, b = (float(np.arctan2(*(points[k] - centre)[::-1])) for k in (0, 2))
            swept = ((b - a) if turns else (a - b)) % (2.0 * np.pi)
            flags = f"{int(swept > np.pi)} {int(not turns)}"
            moves.append(f"A {radius:.4f} {radius:.4f} 0 {flags} {sheet.at(points[2])}")
        else:
            moves += [f"L {sheet.at(point)}" for point in _through(points)[1:]]
    sheet.path(" ".join(moves) + " Z", "edge")


def _polygon(plate: Plate) -> shapely.Polygon:
    """Return the outlines as fine polygons."""
    rings = []
    for outline in plate.outlines:
        if isinstance(outline, Circle):
            rings.append(shapely.Point(outline.centre).buffer(outline.radius, 32).exterior.coords)
        else:
            rings.append(np.concatenate([_fine(piece)[:-1] for piece in outline]))
    return shapely.Polygon(rings[0], rings[1:])


def _fine(piece: OutlinePiece) -> FloatArray:
    if piece.kind == "line":
        return piece.points
    if piece.kind == "curve":
        return _through(piece.points)
    centre = centre_of(*piece.points)
    assert centre is not None
    a, b = (float(np.arctan2(*(piece.points[k] - centre)[::-1])) for k in (0, 2))
    swept = (b - a) % (2.0 * np.pi) if _is_anticlockwise(piece.points) else -((a - b) % (2 * np.pi))
    radius = float(np.linalg.norm(piece.points[0] - centre))
    angles = a + swept * np.linspace(0.0, 1.0, 33)
    return np.asarray(centre + radius * np.column_stack([np.cos(angles), np.sin(angles)]))


def _beside(
    sheet: _Sheet, ring: shapely.Polygon, corner: tuple[float, float], thick: float, axis: int
) -> None:
    """Draw a view along the plate: from the front (axis 0, below the plan) or from the left (1)."""
    low, high = ring.bounds[axis], ring.bounds[2 + axis]

    def at(along: float, up: float) -> tuple[float, float]:
        if axis == 0:
            return corner[0] + along, corner[1] + up
        return corner[0] + up, corner[1] + along

    box = [at(low, 0.0), at(high, 0.0), at(high, thick), at(low, thick)]
    sheet.path("M " + " L ".join(sheet.at(place) for place in box) + " Z", "edge")
    drawn: dict[float, str] = {}
    for loop in (ring.exterior, *ring.interiors):
        for place in _edges(np.array(loop.coords)[:-1], axis):
            along = round(float(place[axis]), 3)
            if along - low < 1e-3 or high - along < 1e-3:
                continue
            kind = "edge" if _is_seen(ring, place, axis) else "hidden"
            if drawn.get(along) != "edge":
                drawn[along] = kind
    for along, kind in sorted(drawn.items()):
        sheet.line(at(along, 0.0), at(along, thick), kind)


def _edges(points: FloatArray, axis: int) -> Iterator[FloatArray]:
    """Yield corners with a sharp bend, and the ends of a smooth outline along an axis."""
    before, after = points - np.roll(points, 1, axis=0), np.roll(points, -1, axis=0) - points
    cross = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
    bend = np.degrees(np.abs(np.arctan2(cross, (before * after).sum(axis=1))))
    yield from points[bend > SHARP]
    yield points[int(points[:, axis].argmin())]
    yield points[int(points[:, axis].argmax())]


def _is_seen(ring: shapely.Polygon, place: FloatArray, axis: int) -> bool:
    """Return whether an edge is visible: nothing of the plate is before it, below it from the
    front, left of it from the left.
    """
    end = place.copy()
    end[1 - axis] = ring.bounds[1 - axis] - 1.0
    way = shapely.LineString([place, end])
    return bool(way.intersection(ring).length < 1e-3)


def _round(sheet: _Sheet, plate: Plate, corner: FloatArray) -> None:
    """Draw diameters and positions of holes, and radii of arcs, each radius once."""
    known: set[str] = set()
    for outline in plate.outlines:
        if isinstance(outline, Circle):
            x, y = (outline.centre + corner).tolist()
            place = f"({number(outline.centre[0])}, {number(outline.centre[1])})"
            words = f"⌀{number(2.0 * outline.radius)} at {place}"
            sheet.text((x, y + outline.radius + 0.8), words)
            for dx, dy in ((1.0, 0.0), (0.0, 1.0)):
                r = outline.radius + 1.0
                sheet.line((x - dx * r, y - dy * r), (x + dx * r, y + dy * r), "thin")
            continue
        for piece in (each for each in outline if each.kind == "arc"):
            centre = centre_of(*piece.points)
            assert centre is not None
            radius = float(np.linalg.norm(piece.points[0] - centre))
            words = f"R{number(radius)}"
            if words in known:
                continue
            known.add(words)
            tip = piece.points[1] + corner
            way = (piece.points[1] - centre) / radius
            inner = tip - LEADER * way
            (tx, ty), (ix, iy) = tip.tolist(), inner.tolist()
            sheet.line((ix, iy), (tx, ty), "thin")
            sheet.arrow((tx, ty), (float(way[0]), float(way[1])))
            sheet.text(
                (ix - np.sign(way[0]) * 0.5, iy - 0.4 * TEXT),
                words,
                "end" if way[0] > 0.0 else "start",
            )


def number(value: float) -> str:
    """Format a length in mm, to a hundredth."""
    return f"{value:.2f}".rstrip("0").rstrip(".")
