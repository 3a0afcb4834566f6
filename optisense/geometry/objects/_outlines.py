"""Signed distances (mm) to plane figures, negative inside, and height profiles.

Coordinates ``x``, ``y`` and distances are arrays of any one shape (...), in mm, and so are results.
"""

from __future__ import annotations

import itertools

import numpy as np

from optisense.array_types import FloatArray

STEEP = 5.67
"""Slope of walls, mm of height per mm: the tangent of 80 degrees, the draft of moulded parts."""


def disc(x: FloatArray, y: FloatArray, radius: float) -> FloatArray:
    """Return the distance (...), mm, to a disc of a radius (mm) around the origin."""
    return np.hypot(x, y) - radius


def rectangle(x: FloatArray, y: FloatArray, width: float, height: float) -> FloatArray:
    """Return the distance (...), mm, to a rectangle around the origin, ``width`` along x."""
    over_x, over_y = np.abs(x) - 0.5 * width, np.abs(y) - 0.5 * height
    outside = np.hypot(np.maximum(over_x, 0.0), np.maximum(over_y, 0.0))
    return outside + np.minimum(np.maximum(over_x, over_y), 0.0)


def hexagon(x: FloatArray, y: FloatArray, across_flats: float) -> FloatArray:
    """Return the distance (...), mm, to the sides of a regular hexagon around the origin,
    perpendicular to the nearest side; ``across_flats`` (mm) is the distance of opposite sides.
    """
    turns = np.radians([0.0, 60.0, 120.0])
    sides = [np.abs(x * np.cos(turn) + y * np.sin(turn)) for turn in turns]
    return np.maximum.reduce(sides) - 0.5 * across_flats


def strokes(x: FloatArray, y: FloatArray, lines: list[list[tuple[float, float]]]) -> FloatArray:
    """Return the distance (...), mm, to the nearest of several polylines (lists of points, mm)."""
    nearest = np.full(x.shape, np.inf)
    for line in lines:
        for start, end in itertools.pairwise(line):
            nearest = np.minimum(nearest, _segment(x, y, np.array(start), np.array(end)))
    return nearest


def _segment(x: FloatArray, y: FloatArray, start: FloatArray, end: FloatArray) -> FloatArray:
    way = end - start
    along = ((x - start[0]) * way[0] + (y - start[1]) * way[1]) / (way @ way)
    share = np.clip(along, 0.0, 1.0)
    return np.hypot(x - start[0] - share * way[0], y - start[1] - share * way[1])


def wall(distance: FloatArray) -> FloatArray:
    """Return the height (...), mm, of a steep wall that begins where a distance (...), mm, is 0 and
    rises outside.
    """
    return STEEP * np.maximum(distance, 0.0)


def raised(distance: FloatArray, height: float) -> FloatArray:
    """Return the height (...), mm, to subtract from a ground for a figure that stands out by
    `height` (mm): all of it inside, and less along its steep wall.
    """
    return np.clip(height - wall(distance), 0.0, height)


def dome(distance: FloatArray, radius: float, height: float) -> FloatArray:
    """Return the height (...), mm, to subtract from a ground for a spherical cap of a base radius
    and a height (mm), by the distance (...), mm, from its middle.
    """
    sphere = (radius**2 + height**2) / (2.0 * height)
    top = np.sqrt(np.maximum(sphere**2 - distance**2, 0.0)) - (sphere - height)
    return np.where(distance < radius, top, 0.0)


def star(x: FloatArray, y: FloatArray, points: int, outer: float, inner: float) -> FloatArray:
    """Return the relative depth (...) of places inside a star, from 0 at its outline to 1 in its
    middle.

    Level lines are smaller stars, so that a relief of these heights has plane facets.

    Args:
        x, y: the places, mm.
        points: number of the star's points.
        outer, inner: radii (mm) of its points and of the corners between them.
    """
    sector = np.pi / points
    angle = np.abs(np.mod(np.arctan2(y, x) + sector, 2.0 * sector) - sector)
    tip = np.array([outer, 0.0])
    valley = inner * np.array([np.cos(sector), np.sin(sector)])
    normal: FloatArray = np.array([valley[1] - tip[1], tip[0] - valley[0]])
    radius = np.hypot(x, y)
    along = radius * (np.cos(angle) * normal[0] + np.sin(angle) * normal[1])
    return np.clip(1.0 - along / float(tip @ normal), 0.0, 1.0)
