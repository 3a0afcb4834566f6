"""Labelled drawing of a section as an SVG element, for notebooks and reports."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from optisense.array_types import FloatArray
from optisense.design.colour import ROLE_LOOKS
from optisense.design.parts import Role
from optisense.design.section import Section, section
from optisense.text import to_html

if TYPE_CHECKING:
    from optisense.design.sensor_design import SensorDesign

WIDTH, LABELS, MARGIN, LINE = 440.0, 190.0, 24.0, 17.0
"""Sizes in pixels: width of the drawing, width of the labels beside it, margin around both, and
distance between labels; a drawing of this size fits a page of text."""

TALLEST = 520.0
"""Largest height of the drawing in pixels, so that it fits a screen below the page's heading."""
DOT = 3.2
"""Radius of the dot that stands for a light, in pixels: large enough to show the light's colour."""

INK = "#1c232b"
RAY, LOST_RAY = "#7a3fb8", "#8d97a3"
"""Colours of chief rays that reach the sensing surface, and of those that do not."""


class _Label(NamedTuple):
    text: str
    x: float
    y: float


class DrawnRay(NamedTuple):
    """Chief ray to draw.

    Attributes:
        points: points (n, 3) in the design's frame, mm: the camera, each refraction or reflection,
            and the end.
        arrived: whether it ends on the sensing surface.
    """

    points: FloatArray
    arrived: bool


def section_svg(design: SensorDesign, rays: Sequence[DrawnRay] = ()) -> str:
    """Return a labelled section through a design, with chief rays of the camera, as an SVG element.

    The camera's view points upward. Lights and rays are projected onto the plane of the section.
    """
    found = section(design)
    low, high = found.bounds
    size = np.maximum(high - low, 1e-6)
    scale = float(min(WIDTH / size[0], TALLEST / size[1]))
    width, height = scale * size

    def place(points: FloatArray) -> FloatArray:
        shifted = (points - low) * scale
        return np.stack(
            [MARGIN + shifted[..., 0], MARGIN + height - shifted[..., 1]], axis=-1
        )  # fmt: skip

    shapes, labels = [], []
    for outline in found.outlines:
        colour, alpha = ROLE_LOOKS.get(outline.role.value, ("#999999", 1.0))
        lines = [place(line) for line in outline.lines]
        solid = outline.role is not Role.SENSING_SURFACE and all(
            np.array_equal(line[0], line[-1]) for line in lines
        )
        path = " ".join(_path(line) for line in lines)
        if solid:
            shapes.append(
                f'<path d="{path}" fill="{colour}" fill-opacity="{max(alpha, 0.35)}" '
                f'fill-rule="evenodd" stroke="{INK}" stroke-width="0.7"/>'
            )
        else:
            shapes.append(f'<path d="{path}" fill="none" stroke="{INK}" stroke-width="2.2"/>')
        x, y = _anchor(lines, solid)
        labels.append(_Label(outline.name.replace("_", " "), x, y))
    column = 2 * MARGIN + width
    shapes += _camera(found, place, scale)
    if rays:
        ways = [place(_flat(ray.points, found)) for ray in rays]
        shapes.append(_rays(ways, [ray.arrived for ray in rays], column))
        arrived = [way for way, ray in zip(ways, rays, strict=True) if ray.arrived]
        x, y = (arrived or ways)[len(arrived or ways) // 2][:2].mean(axis=0)
        labels.append(_Label(f"{len(arrived)} of {len(rays)} rays reach the skin", x, y))
    x, y = place(found.camera)
    labels.append(_Label(f"camera, {design.camera.fov:.3g}° across", x, y))
    colours: dict[tuple[float, float], list[str]] = {}
    for name, spots in found.lights.items():
        middles = place(spots)
        r, g, b = (round(255 * min(1.0, value)) for value in found.colours[name])
        for x, y in middles:
            there = colours.setdefault((round(float(x), 1), round(float(y), 1)), [])
            if f"rgb({r},{g},{b})" not in there:
                there.append(f"rgb({r},{g},{b})")
        x, y = middles[middles[:, 0].argmax()]
        labels.append(_Label(f"{name} lights", x, y))
    shapes += [_light(x, y, there) for (x, y), there in colours.items()]

    tall = max(height + 2 * MARGIN, LINE * len(labels) + 2 * MARGIN) + 16
    shapes += _labels(labels, column, tall - 16)
    shapes.append(_scale_bar(scale, width, tall))
    whole = column + LABELS
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {whole:.0f} {tall:.0f}" '
        f'width="{whole:.0f}" height="{tall:.0f}" role="img" '
        f'aria-label="section through {to_html(design.name)}" '
        'style="background:#fff;max-width:100%;height:auto;font:12px sans-serif">'
        + "".join(shapes)
        + "</svg>"
    )


def _path(line: FloatArray) -> str:
    """Return SVG path data of a polyline, closed if its last point is its first."""
    closed = len(line) > 2 and np.array_equal(line[0], line[-1])
    points = line[:-1] if closed else line
    return "M" + "L".join(f"{x:.1f} {y:.1f}" for x, y in points) + ("Z" if closed else "")


def _anchor(lines: list[FloatArray], solid: bool) -> tuple[float, float]:
    """Return the end of a label's line: well inside a solid, on its right; else on the outline."""
    points = np.concatenate(lines)
    if not solid:
        x, y = points[points[:, 0].argmax()]
        return float(x), float(y)
    best = 0.0
    x, y = points.mean(axis=0)
    low, high = points[:, 1].min(), points[:, 1].max()
    for level in np.linspace(low, high, 9)[1:-1] + 1e-6:
        ends: list[float] = []
        for line in lines:
            one, other = line[:-1], line[1:]
            crosses = (one[:, 1] > level) != (other[:, 1] > level)
            a, b = one[crosses], other[crosses]
            ends += list(a[:, 0] + (level - a[:, 1]) / (b[:, 1] - a[:, 1]) * (b[:, 0] - a[:, 0]))
        ends.sort()
        for left, right in zip(ends[::2], ends[1::2], strict=False):
            if right - left > best:
                best, x, y = right - left, right - 0.12 * (right - left), level
    return float(x), float(y)


def _light(x: float, y: float, colours: list[str]) -> str:
    """Return a dot; if lights of several colours lie behind one another, a sector for each."""
    circle = f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{DOT}"'
    edge = f'stroke="{INK}" stroke-width="0.7"/>'
    if len(colours) == 1:
        return f'{circle} fill="{colours[0]}" {edge}'
    turns = np.linspace(0.0, 2.0 * np.pi, len(colours) + 1)
    rim = np.stack([x + DOT * np.sin(turns), y + DOT * np.cos(turns)], axis=1)
    sectors = [
        f'<path d="M{x:.1f} {y:.1f}L{a[0]:.2f} {a[1]:.2f}'
        f'A{DOT} {DOT} 0 0 0 {b[0]:.2f} {b[1]:.2f}Z" fill="{colour}"/>'
        for colour, a, b in zip(colours, rim[:-1], rim[1:], strict=True)
    ]
    return "".join(sectors) + f'{circle} fill="none" {edge}'


def _labels(labels: list[_Label], column: float, tall: float) -> list[str]:
    """Return labels in a column, in the order of their anchors and near them, with lines."""
    ordered = sorted(labels, key=lambda label: (label.y, -label.x))
    wanted = np.array([label.y for label in ordered])
    spots = np.maximum.accumulate(wanted - LINE * np.arange(len(wanted)))
    spots = spots + LINE * np.arange(len(wanted))
    over = max(0.0, float(spots[-1]) - (tall - MARGIN))
    # Shift up from the bottom the labels that would leave the drawing.
    limit = spots[-1] - over - LINE * np.arange(len(spots))[::-1]
    spots = np.minimum(spots, limit)
    shapes = []
    for label, y in zip(ordered, spots, strict=True):
        shapes.append(
            f'<path d="M{label.x:.1f} {label.y:.1f}L{column - 6:.1f} {y:.1f}" fill="none" '
            f'stroke="{INK}" stroke-width="0.5" stroke-opacity="0.7"/>'
            f'<circle cx="{label.x:.1f}" cy="{label.y:.1f}" r="1.5" fill="{INK}"/>'
            f'<text x="{column:.1f}" y="{y + 4:.1f}" fill="{INK}">{to_html(label.text)}</text>'
        )
    return shapes


def _camera(found: Section, place: Callable[[FloatArray], FloatArray], scale: float) -> list[str]:
    """Return the pupil and the borders of the view, a quarter of the drawing long."""
    x, y = place(found.camera)
    angle = np.radians(min(found.half_angle, 120.0))
    length = 0.25 * scale * float(np.ptp(found.bounds[:, 1]))
    shapes = [
        f'<path d="M{x:.1f} {y:.1f}l{side * length * np.sin(angle):.1f} '
        f'{-length * np.cos(angle):.1f}" stroke="{INK}" stroke-width="0.8" '
        'stroke-dasharray="4 3" fill="none"/>'
        for side in (-1, 1)
    ]
    shapes.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="4" fill="{INK}"/>')
    return shapes


def _flat(points: FloatArray, found: Section) -> FloatArray:
    """Return points (n, 3) projected onto the plane of a section, (n, 2)."""
    return np.stack([points @ found.across, points @ found.along], axis=-1)


def _rays(ways: list[FloatArray], arrived: list[bool], column: float) -> str:
    """Return polylines, cut off where the labels begin; rays that do not arrive are dashed."""
    seen, lost = f'stroke="{RAY}"', f'stroke="{LOST_RAY}" stroke-dasharray="3 3"'
    lines = "".join(
        f'<path d="{_path(way)}" {seen if hit else lost}/>'
        for way, hit in zip(ways, arrived, strict=True)
    )
    style = 'fill="none" stroke-width="0.9" stroke-opacity="0.85"'
    return f'<svg width="{column - 8:.0f}" height="100%"><g {style}>{lines}</g></svg>'


def _scale_bar(scale: float, width: float, tall: float) -> str:
    """Return a bar of a round length near a fifth of the drawing's width."""
    ideal = width / scale / 5
    power = 10.0 ** np.floor(np.log10(ideal))
    length = max(step * power for step in (1, 2, 5) if step * power <= ideal)
    x, y = MARGIN, tall - 12
    return (
        f'<path d="M{x:.1f} {y:.1f}h{length * scale:.1f}" stroke="{INK}" stroke-width="2"/>'
        f'<text x="{x + length * scale + 6:.1f}" y="{y + 4:.1f}" fill="{INK}">{length:g} mm</text>'
    )
