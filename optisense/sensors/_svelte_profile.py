"""Side view of a finger with two mirrors: curves in the plane y = 0, as (x, z) in mm.

x points from the back of the finger to its palm, z from the base to the tip, and the origin is the
camera's entrance pupil.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray

from optisense.array_types import FloatArray
from optisense.errors import DesignError

Points = Sequence[tuple[float, float]]

SAGITTA_STEP = 0.1
"""Step of the sagitta in the search for the largest one clear of the skin, mm; then bisection."""

PROFILE_SAMPLES = 200
"""Number of points along the mirror's profile, which keep the polygon within 1 um of the curve."""

LONGEST_M2 = 24.3
"""Length of M2 as measured in the animation of the sensor, mm."""

SIGHT_MARGIN = 0.2
"""Length at the end of M2 that is left out, mm, so that no line of sight grazes the gel."""


@dataclass(frozen=True)
class Palm:
    """Coated face of the skin in side view, from the base to the tip.

    Attributes:
        points: points (n, 2), evenly spaced, mm.
        inward: unit normals (n, 2) into the gel.
        length: length along the curve, mm.
    """

    points: FloatArray
    inward: FloatArray
    length: float

    @staticmethod
    def through(outline: Points, spacing: float) -> Palm:
        """Return a smooth curve (cubic spline over chord length) through points from base to tip.

        Raises:
            DesignError: there are fewer than three points, or two neighbours coincide.
        """
        corners = np.asarray(outline, dtype=np.float64).reshape(-1, 2)
        steps = np.linalg.norm(np.diff(corners, axis=0), axis=1)
        if len(corners) < 3 or not (steps > 0.0).all():
            raise DesignError(
                "the palm's outline needs three or more different points, from base to tip",
                where="palm_outline",
                hint="Give (x, z) in mm, x towards the palm, z towards the tip",
            )
        knots = np.append(0.0, np.cumsum(steps))
        slopes = _spline_slopes(knots, corners)
        fine = np.linspace(0.0, knots[-1], 8 * PROFILE_SAMPLES)
        walked = np.linalg.norm(np.diff(_hermite(fine, knots, corners, slopes)[0], axis=0), axis=1)
        along = np.append(0.0, np.cumsum(walked))
        count = max(2, round(along[-1] / spacing)) + 1
        at = np.interp(np.linspace(0.0, along[-1], count), along, fine)
        points, tangent = _hermite(at, knots, corners, slopes)
        tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
        inward = np.column_stack([-tangent[:, 1], tangent[:, 0]])
        return Palm(points, inward, float(along[-1]))

    def offset(self, depth: float) -> FloatArray:
        """Return the curve `depth` mm inside the skin, (n, 2) mm.

        Raises:
            DesignError: the skin is thicker than the radius of a bend of the palm.
        """
        inner = self.points + depth * self.inward
        forward = np.einsum("ij,ij->i", np.diff(inner, axis=0), np.diff(self.points, axis=0))
        if (forward <= 0.0).any():
            x, z = self.points[int(np.argmin(forward))]
            raise DesignError(
                f"a gel of {depth:g} mm does not fit: the palm bends more sharply than that",
                where=f"palm_outline near x {x:.1f}, z {z:.1f} mm",
                hint="Make gel_thickness smaller, or round palm_outline there",
            )
        return inner

    def at(self, share: float, depth: float) -> tuple[FloatArray, FloatArray]:
        """Return the point `depth` mm inside at a share (0..1) of the length, and the tangent."""
        rows = np.arange(len(self.points)) / (len(self.points) - 1)
        middle = self.points + depth * self.inward
        point = np.array([np.interp(share, rows, middle[:, k]) for k in (0, 1)])
        normal = np.array([np.interp(share, rows, self.inward[:, k]) for k in (0, 1)])
        normal /= np.linalg.norm(normal)
        return point, np.array([normal[1], -normal[0]])


@dataclass(frozen=True)
class CurvedMirror:
    """M1 in side view: a parabola through a fixed middle, whose ends move forward as it bends.

    Attributes:
        middle: middle point, (2,) mm.
        along: unit vector (2,) from the base's end to the tip's.
        forward: unit normal (2,) towards the palm.
        length: length of the chord, mm.
    """

    middle: FloatArray
    along: FloatArray
    forward: FloatArray
    length: float

    @staticmethod
    def from_arc(lower: ArrayLike, upper: ArrayLike, sagitta: float) -> CurvedMirror:
        """Return the mirror of an arc by its ends, (2,) mm, and its depth behind the chord, mm."""
        first, last = np.asarray(lower, dtype=float), np.asarray(upper, dtype=float)
        along = (last - first) / np.linalg.norm(last - first)
        forward = np.array([along[1], -along[0]])
        middle = 0.5 * (first + last) - sagitta * forward
        return CurvedMirror(middle, along, forward, float(np.linalg.norm(last - first)))

    def curve(self, sagitta: float, count: int = PROFILE_SAMPLES) -> FloatArray:
        """Return the mirror with its ends `sagitta` mm before its middle, (count, 2) mm."""
        t = np.linspace(-1.0, 1.0, count)[:, None]
        straight = self.middle + 0.5 * self.length * t * self.along
        return np.asarray(straight + sagitta * t * t * self.forward)

    def largest_sagitta(self, obstacle: FloatArray, clearance: float) -> float:
        """Return the largest sagitta with which it keeps `clearance` from the closed outline (n, 2)
        of the skin, mm.

        Raises:
            DesignError: even the flat mirror is closer.
        """
        skin = shapely.Polygon(obstacle)
        shapely.prepare(skin)

        def too_near(sagittas: FloatArray) -> NDArray[np.bool_]:
            curves = shapely.linestrings([self.curve(sagitta) for sagitta in sagittas])
            return np.asarray(shapely.dwithin(skin, curves, clearance))

        if too_near(np.zeros(1))[0]:
            gap = shapely.LineString(self.curve(0.0)).distance(skin)
            raise DesignError(
                f"the flat mirror M1 comes as near as {gap:.2f} mm to the skin; "
                f"{clearance:g} mm must stay free",
                where="m1_ends",
                hint="Move m1_ends away from the palm, or make gel_thickness or clearance smaller",
            )
        tried = np.arange(0.0, 0.5 * self.length, SAGITTA_STEP)
        found = too_near(tried)
        if not found.any():
            return float(tried[-1])
        high = float(tried[np.argmax(found)])
        low = high - SAGITTA_STEP
        for _ in range(20):
            middle = 0.5 * (low + high)
            low, high = (low, middle) if too_near(np.array([middle]))[0] else (middle, high)
        return low


def _spline_slopes(knots: FloatArray, values: FloatArray) -> FloatArray:
    """Return the slopes at the knots (n,) of the cubic spline through values (n, 2), with
    continuous curvature; its first and its last two pieces are one cubic each (three knots: one
    parabola).

    It equals `scipy.interpolate.CubicSpline`, whose import takes longer than building the sensor.
    """
    count, width = len(knots), np.diff(knots)
    rise = np.diff(values, axis=0) / width[:, None]
    matrix, right = np.zeros((count, count)), np.zeros_like(values)
    for k in range(1, count - 1):
        matrix[k, k - 1 : k + 2] = width[k], 2.0 * (width[k - 1] + width[k]), width[k - 1]
        right[k] = 3.0 * (width[k] * rise[k - 1] + width[k - 1] * rise[k])
    for row, (a, b), (near, far) in (
        (0, width[:2], (0, 1)),
        (count - 1, width[:-3:-1], (count - 2, count - 3)),
    ):
        inner = 1 if row == 0 else count - 2
        if count == 3:
            matrix[row, row], matrix[row, inner] = 1.0, 1.0
            right[row] = 2.0 * rise[near]
        else:
            matrix[row, row], matrix[row, inner] = b, a + b
            right[row] = ((2.0 * b + 3.0 * a) * b * rise[near] + a * a * rise[far]) / (a + b)
    return np.asarray(np.linalg.solve(matrix, right))


def _hermite(
    at: FloatArray, knots: FloatArray, values: FloatArray, slopes: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return points and slopes (n, 2) of the piecewise cubic with these values and slopes."""
    piece = np.clip(np.searchsorted(knots, at, side="right") - 1, 0, len(knots) - 2)
    width = np.diff(knots)[piece, None]
    t = (at[:, None] - knots[piece, None]) / width
    start, end = values[piece], values[piece + 1]
    out, into = width * slopes[piece], width * slopes[piece + 1]
    cubic, square = 2.0 * (start - end) + out + into, 3.0 * (end - start) - 2.0 * out - into
    points = ((cubic * t + square) * t + out) * t + start
    return points, ((3.0 * cubic * t + 2.0 * square) * t + out) / width


def mirrored(point: ArrayLike, on: ArrayLike, direction: ArrayLike) -> FloatArray:
    """Return a point mirrored in the line through `on` along a unit `direction`, (2,) mm."""
    away = np.asarray(point, dtype=float) - np.asarray(on, dtype=float)
    way = np.asarray(direction, dtype=float)
    return np.asarray(np.asarray(on, dtype=float) + 2.0 * (away @ way) * way - away)


def crossing(
    start: FloatArray, ends: FloatArray, on: FloatArray, direction: FloatArray
) -> FloatArray:
    """Return distances (n,), mm, along a line at which lines from `start` to `ends` cross it."""
    way = ends - start
    normal = np.array([-direction[1], direction[0]])
    step = ((on - start) @ normal) / (way @ normal)
    return np.asarray((start + step[:, None] * way - on) @ direction)


@dataclass(frozen=True)
class FlatMirror:
    """M2 in side view, seen from the pupil at the origin.

    Attributes:
        bottom: end at the base, (2,) mm.
        along: unit vector (2,) towards its upper end.
        length: length, mm.
    """

    bottom: FloatArray
    along: FloatArray
    length: float

    @staticmethod
    def facing(
        bottom: ArrayLike, tilt: float, length: float | None, inner: FloatArray
    ) -> FlatMirror:
        """Return a mirror by its end at the base, (2,) mm, its angle to the z axis, degrees, and
        its length, mm; None for `LONGEST_M2` or as much of it as sees M1 past the inner face (n, 2)
        of the gel.

        Raises:
            DesignError: its back is to the camera, or its sight past the gel is blocked.
        """
        start = np.asarray(bottom, dtype=np.float64)
        along = np.array([np.sin(np.radians(tilt)), np.cos(np.radians(tilt))])
        if start[0] * along[1] - start[1] * along[0] <= 0.0:
            raise DesignError(
                "mirror M2 does not face the camera at (0, 0)",
                where="m2_bottom, m2_tilt",
                hint="Put m2_bottom on the palm's side of the camera (x above 0), and tilt less",
            )
        pupil = mirrored((0.0, 0.0), start, along)
        free = float(crossing(pupil, inner, start, along).min())
        wanted = LONGEST_M2 if length is None else length
        if length is None and free > 0.0:
            wanted = min(wanted, free - SIGHT_MARGIN)
        if wanted > free:
            raise DesignError(
                f"only the lower {max(free, 0.0):.1f} mm of mirror M2 ({wanted:.1f} mm long) see "
                "M1 past the gel",
                where="m2_length",
                hint="Make m2_length smaller, tilt M2 more (m2_tilt), or move m2_bottom towards "
                "the camera",
            )
        return FlatMirror(start, along, wanted)

    def ends(self) -> FloatArray:
        """Return lower and upper end, (2, 2) mm."""
        return np.array([self.bottom, self.bottom + self.length * self.along])

    def seen_between(self) -> tuple[float, float]:
        """Return the angles of its ends seen from the pupil, from x towards the tip, radians."""
        low, high = np.arctan2(self.ends()[:, 1], self.ends()[:, 0])
        return float(low), float(high)

    def angle_of(self, point: FloatArray) -> float:
        """Return the angle at which the camera sees a point (2,) in it, from the x axis towards the
        tip, radians.
        """
        pupil = mirrored((0.0, 0.0), self.bottom, self.along)
        at = self.bottom + crossing(pupil, point[None], self.bottom, self.along)[0] * self.along
        return float(np.arctan2(at[1], at[0]))
