"""Drawings of plates: an outline to cut (DXF), and a sheet with three views and dimensions (SVG).

The views are those of the third angle: the plan is on top, the front view below it, and the view
from the right at its right.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from string import ascii_uppercase

import numpy as np
import shapely
from scipy.interpolate import CubicSpline

from optisense.array_types import FloatArray
from optisense.text import to_html
from optisense.workshop._dxf import Pair, arc, circle, dxf, line
from optisense.workshop._plates import Circle, Plate
from optisense.workshop._profiles import OutlinePiece
from optisense.workshop._sheet import LETTER, STYLE, TEXT, DrawingSheet, apart, number

GAP = 16.0
"""Distance between two views, mm: room for a dimension and its number."""

BORDER = 8.0
"""Margin around the drawing, mm; printers leave 4 to 6 mm of a sheet blank."""

OFF = 7.0
"""Distance between a view and the line of its dimension, mm: nearly half of `GAP`, so that the
number stands clear of both views."""

STEPS_OF_CURVE = 4
"""Number of points for each corner of a curve in a DXF file, whose release 12 has no splines."""

SHARP = 20.0
"""Angle from which on a corner counts as an edge that is visible from the side, degrees."""

LEADER = 8.0
"""Length of the line from an arc to its radius, mm."""

ROW = 2.2 * TEXT
"""Distance between two lines of text, mm."""

MOST_STEPS = 12
"""Number of places of edges along x or y up to which each has its dimension, if their numbers have
room. A plate of more is a freely curved or toothed one, which is cut from its file."""

SAME = 1e-3
"""Difference of lengths, mm, that counts as none: far below the accuracy of cutting."""


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
        centre, radius, first, sweep = piece.arc()
        start, end = np.degrees(sorted((first, first + sweep))) % 360.0
        yield arc("CUT", centre.tolist(), radius, float(start), float(end))
    else:
        points = _through(piece.points)
        for one, other in zip(points[:-1].tolist(), points[1:].tolist(), strict=True):
            yield line("CUT", one, other)


def _through(points: FloatArray) -> FloatArray:
    """Return points (k, 2) of a cubic spline through points (n, 2), mm."""
    lengths = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    shares = np.linspace(0.0, 1.0, STEPS_OF_CURVE + 1)[:-1]
    fine = np.concatenate([(lengths[:-1, None] + shares * np.diff(lengths)[:, None]).reshape(-1),
                           lengths[-1:]])  # fmt: skip
    return np.asarray(CubicSpline(lengths, points)(fine))


def drawing(plate: Plate, title: str) -> str:
    """Return three views of a plate at 1:1 with its dimensions, as an SVG picture in mm."""
    ring = _polygon(plate)  # with its arcs, of which a mesh has only chords
    width, depth, thick = ring.bounds[2], ring.bounds[3], plate.thickness
    features = _features(plate)
    words = _words(plate, title, [text for _, text in features])
    left, bottom = BORDER + OFF + TEXT, BORDER + ROW * (len(words) + 0.5)
    front = bottom + OFF
    plan = front + thick + GAP
    side = left + width + GAP
    widest = 2.0 * BORDER + LETTER * max(len(line) for line in words)
    whole = max(side + thick + OFF + BORDER + 2.0 * TEXT, widest), plan + depth + BORDER + OFF
    sheet = DrawingSheet(whole[1])
    corner = np.array([left, plan])
    for outline in plate.outlines:
        _plan(sheet, outline, corner)
    _beside(sheet, ring, (left, front), thick, 0)
    _beside(sheet, ring, (side, plan), thick, 1)
    sheet.across(left, left + width, plan + depth, plan + depth + OFF)
    sheet.up(plan, plan + depth, left, left - OFF)
    sheet.up(front, front + thick, left, left - OFF)
    for axis, side_length, foot in (
        (0, width, (plan - 1.0, plan - 3.0)),
        (1, depth, (left + width + 1.0, left + width + 3.0)),
    ):
        steps = [0.0, *_steps(plate, ring, axis)]
        # Numbers may reach as far beyond the side as the line of its length does.
        if 1 < len(steps) <= MOST_STEPS + 1 and apart(steps)[-1] < side_length + OFF:
            sheet.ordinates(steps, foot, corner, axis)
    _round(sheet, plate, ring, corner)
    for letter, (place, _) in zip(_letters(), features, strict=False):
        sheet.text(tuple((place + corner).tolist()), letter, "start")
    for row, text in enumerate(words):
        sheet.text((BORDER, BORDER + ROW * (len(words) - 1 - row)), text, "start")
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


def _plan(sheet: DrawingSheet, outline: Circle | list[OutlinePiece], corner: FloatArray) -> None:
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
            _, radius, _, sweep = piece.arc()
            flags = f"{int(abs(sweep) > np.pi)} {int(sweep < 0.0)}"
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
    return piece.arc().points(33)


def _beside(
    sheet: DrawingSheet, ring: shapely.Polygon, corner: tuple[float, float], thick: float, axis: int
) -> None:
    """Draw a view along the plate: from the front (0, below the plan) or from the right (1)."""
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
    yield from _corners(points)
    yield points[int(points[:, axis].argmin())]
    yield points[int(points[:, axis].argmax())]


def _corners(points: FloatArray) -> FloatArray:
    """Return the corners (k, 2) of a closed outline with a sharp bend."""
    before, after = points - np.roll(points, 1, axis=0), np.roll(points, -1, axis=0) - points
    cross = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
    bend = np.degrees(np.abs(np.arctan2(cross, (before * after).sum(axis=1))))
    return np.asarray(points[bend > SHARP])


def _is_seen(ring: shapely.Polygon, place: FloatArray, axis: int) -> bool:
    """Return whether an edge is visible: nothing of the plate is before it, below it from the
    front, right of it from the right.
    """
    end = place.copy()
    end[1 - axis] = ring.bounds[1] - 1.0 if axis == 0 else ring.bounds[2] + 1.0
    way = shapely.LineString([place, end])
    return bool(way.intersection(ring).length < 1e-3)


def _words(plate: Plate, title: str, features: list[str]) -> list[str]:
    """Return the lines of text under the views: the title, and a table of holes."""
    of = f", {plate.material}" if plate.material else ""
    words = [
        f"{plate.name}: {plate.count} x {number(plate.thickness)} mm{of}",
        f"{title}; mm, 1:1",
        "plan, front view, right view (third angle)",
    ]
    if features:
        words.append("(x, y) from the lower left corner:")
    return words + [f"{letter}: {text}" for letter, text in zip(_letters(), features, strict=False)]


def _letters() -> Iterator[str]:
    """Yield A to Z, then AA to AZ, BA and so on, without end."""
    for count in itertools.count(1):
        yield from map("".join, itertools.product(ascii_uppercase, repeat=count))


def _features(plate: Plate) -> list[tuple[FloatArray, str]]:
    """Return the place (2,) of the letter of each hole, mm, and what the table says of it."""
    found: list[tuple[FloatArray, str]] = []
    for index, outline in enumerate(plate.outlines):
        if isinstance(outline, Circle):
            beside = outline.centre + np.sqrt(0.5) * outline.radius + 0.8
            words = f"⌀{number(2.0 * outline.radius)} at {_at(outline.centre)}"
            found.append((beside, words))
            continue
        if index == 0:
            continue
        points = np.concatenate([_fine(piece) for piece in outline])
        low, high = points.min(axis=0), points.max(axis=0)
        slot = _slot(outline)
        if slot is None:
            words = f"opening {_by(high - low)}, lower left corner at {_at(low)}"
            found.append((0.5 * (low + high), words))
            continue
        length, wide, angle = slot
        turned = f", {number(angle)} degrees to x" if angle > SAME else ""
        words = f"slot {number(length)} x {number(wide)} at {_at(0.5 * (low + high))}"
        found.append((high, words + turned))
    return found


def _at(point: FloatArray) -> str:
    return f"({number(point[0])}, {number(point[1])})"


def _by(size: FloatArray) -> str:
    return f"{number(size[0])} x {number(size[1])}"


def _slot(outline: list[OutlinePiece]) -> tuple[float, float, float] | None:
    """Return length and width (mm) of a slot with round ends, and its angle to x (degrees, from 0
    to 180); None for another outline.
    """
    if [piece.kind for piece in outline] != ["line", "arc", "line", "arc"]:
        return None
    ends = outline[1], outline[3]
    one, other = (end.arc() for end in ends)
    widths = [float(np.linalg.norm(end.points[2] - end.points[0])) for end in ends]
    if np.ptp([*widths, 2.0 * one.radius, 2.0 * other.radius]) > SAME:
        return None
    along = other.centre - one.centre
    angle = float(np.degrees(np.arctan2(along[1], along[0]))) % 180.0
    return (
        float(np.linalg.norm(along)) + widths[0],
        widths[0],
        0.0 if 180.0 - angle < SAME else angle,
    )


def _steps(plate: Plate, ring: shapely.Polygon, axis: int) -> list[float]:
    """Return the distances along an axis, mm, of corners and of straight edges across it, without
    the sides of the plate and those of openings, which the table gives, ascending.
    """
    found: set[float] = set()
    for outline, loop in zip(plate.outlines, (ring.exterior, *ring.interiors), strict=True):
        if isinstance(outline, Circle) or _slot(outline) is not None:
            continue
        places = list(_corners(np.array(loop.coords)[:-1]))
        lines = [piece.points for piece in outline if piece.kind == "line"]
        places += [ends[0] for ends in lines if abs(ends[1, axis] - ends[0, axis]) < SAME]
        low, high = loop.bounds[axis], loop.bounds[2 + axis]
        along = (round(float(place[axis]), 2) for place in places)
        found |= {value for value in along if low + 0.01 < value < high - 0.01}
    return sorted(found)


def _round(sheet: DrawingSheet, plate: Plate, ring: shapely.Polygon, corner: FloatArray) -> None:
    """Draw axes of holes, and radii of arcs, each radius once, where it is farthest from holes."""
    arcs: dict[str, list[tuple[FloatArray, FloatArray]]] = {}
    for outline in plate.outlines:
        if isinstance(outline, Circle):
            x, y = (outline.centre + corner).tolist()
            for dx, dy in ((1.0, 0.0), (0.0, 1.0)):
                r = outline.radius + 1.0
                sheet.line((x - dx * r, y - dy * r), (x + dx * r, y + dy * r), "thin")
            continue
        if _slot(outline) is not None:
            continue
        for piece in (each for each in outline if each.kind == "arc"):
            centre, radius, _, _ = piece.arc()
            way = (piece.points[1] - centre) / radius
            arcs.setdefault(f"R{number(radius)}", []).append((piece.points[1], way))

    def room(arc: tuple[FloatArray, FloatArray]) -> float:
        end = shapely.Point(arc[0] - LEADER * arc[1])
        return min((float(end.distance(hole)) for hole in ring.interiors), default=0.0)

    for words, found in arcs.items():
        tip, way = max(found, key=room)
        inner = tip + corner - LEADER * way
        (tx, ty), (ix, iy) = (tip + corner).tolist(), inner.tolist()
        sheet.line((ix, iy), (tx, ty), "thin")
        sheet.arrow((tx, ty), (float(way[0]), float(way[1])))
        sheet.text(
            (ix - np.sign(way[0]) * 0.5, iy - 0.4 * TEXT),
            words,
            "end" if way[0] > 0.0 else "start",
        )
