"""Smoothed scores of chief rays, with their derivatives.

The scores themselves jump when a ray begins or ceases to arrive. In the smoothed scores each ray
has a weight, the area of the picture that it stands for, which changes smoothly when the boundary
beside it moves (`OpticalModel.differentiable_rays`), and the sums are weighted. The area of the
triangles seen becomes the area seen, and their number, which AOAP counts, the integral of their
number for each mm² over what is seen.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from optisense.array_types import FloatArray
from optisense.objectives._aoap import COVERAGE_WEIGHT
from optisense.objectives._footprints import MOST_ANISOTROPY
from optisense.objectives._projection_warping import MOST_EVEN

if TYPE_CHECKING:
    from optisense.optics.transport.ray_gradient import DifferentiableRays


class Slopes(NamedTuple):
    """A smoothed score, and its derivatives with respect to attributes of the rays; None for those
    that it does not depend on.
    """

    value: float
    cosine: FloatArray | None
    weight: FloatArray
    points: FloatArray | None


def smooth_aoap(rays: DifferentiableRays, *, coverage_weight: float = COVERAGE_WEIGHT) -> Slopes:
    """Return the mean over all pixels of weight times cosine between ray and normal, plus k1 times
    the share of the surface's triangles that are seen.
    """
    count = rays.codes.size
    seen = _density_in_view(rays, rays.density)
    value = float((rays.cosine * rays.weight).sum() / count) + coverage_weight * seen.value
    by_weight = rays.cosine / count + coverage_weight * seen.weight
    assert seen.points is not None
    return Slopes(value, rays.weight / count, by_weight, coverage_weight * seen.points)


def smooth_coverage(rays: DifferentiableRays) -> Slopes:
    """Return the seen share of the surface's area."""
    return _density_in_view(rays, np.full(len(rays.points), 1.0 / rays.surface_area))


def _density_in_view(rays: DifferentiableRays, at_points: FloatArray) -> Slopes:
    """Return the integral over the area in view of a density (k,), 1/mm², at the end points."""
    triangles = _PixelTriangles(rays)
    density = triangles.mean_of_corners(at_points)
    value = float((density * triangles.weight * triangles.area).sum())
    # The motion of points inside the view does not change what is seen; only the motion of points
    # at its border does. Around inner points these sums vanish.
    by_points = at_points[:, None] * triangles.by_points(triangles.weight)
    return Slopes(value, None, triangles.by_weight(density * triangles.area), by_points)


def smooth_projection_warping(rays: DifferentiableRays) -> Slopes:
    """Return weighted mean over weighted deviation of the areas between neighbouring points."""
    triangles = _PixelTriangles(rays)
    area, weight = triangles.area, triangles.weight
    if len(area) < 2:
        return Slopes(0.0, None, np.zeros_like(rays.weight), None)
    total = max(float(weight.sum()), 1e-12)
    mean = float((weight * area).sum()) / total
    variance = max(float((weight * (area - mean) ** 2).sum()) / total, 0.0)
    spread = max(np.sqrt(variance), MOST_EVEN * mean)

    by_mean, by_spread = 1.0 / spread, -mean / spread**2
    off = area - mean
    by_area = weight / total * (by_mean + by_spread * off / spread)
    by_weight = (by_mean * off + by_spread * (off**2 - variance) / (2 * spread)) / total
    slopes = triangles.by_weight(by_weight)
    return Slopes(mean / spread, None, slopes, triangles.by_points(by_area))


def smooth_distortion(rays: DifferentiableRays) -> Slopes:
    """Return the weighted geometric mean of the anisotropies of footprints of four neighbours."""
    corners = _quads(rays.codes)
    if not len(corners):
        return Slopes(1.0, None, np.zeros_like(rays.weight), None)
    top_left, top_right, low_left, low_right = (rays.points[corners[:, k]] for k in range(4))
    across = 0.5 * (top_right - top_left + low_right - low_left)
    along = 0.5 * (low_left - top_left + low_right - top_right)
    a, b, c = ((u * v).sum(axis=1) for u, v in ((across, across), (across, along), (along, along)))
    middle, half = 0.5 * (a + c), 0.5 * (a - c)
    apart = np.hypot(half, b)
    # The logarithm of the ratio of the roots of both eigenvalues of [[a, b], [b, c]]. Round
    # footprints have no derivative, and grazing ones the largest ratio of the score.
    least = (1.0 - 2.0 / (1.0 + MOST_ANISOTROPY**2)) * middle
    inner = np.minimum(apart, least)
    ratio = 0.5 * np.log((middle + inner) / np.maximum(middle - inner, 1e-300))
    count = np.bincount(corners.ravel(), minlength=len(rays.weight))
    # A pixel stands for one footprint; this is the share of it for each of the ray's footprints.
    share = 1.0 / np.maximum(count, 1)
    weight = 1.0 + ((rays.weight - 1.0) * share)[corners].sum(axis=1)
    total = max(float(weight.sum()), 1e-12)
    mean = float((weight * ratio).sum()) / total
    value = float(np.exp(mean))

    free = (apart < least) & (apart > 1e-9 * middle)
    square = np.where(free, middle**2 - apart**2, 1.0)
    by_middle = np.where(free, -apart / square, 0.0)
    by_apart = np.where(free, middle / square, 0.0)
    length = np.where(free, apart, 1.0)
    by_a = 0.5 * by_middle + by_apart * 0.5 * half / length
    by_c = 0.5 * by_middle - by_apart * 0.5 * half / length
    by_b = by_apart * b / length
    scale = (value * weight / total)[:, None]
    by_across = scale * (2.0 * by_a[:, None] * across + by_b[:, None] * along)
    by_along = scale * (2.0 * by_c[:, None] * along + by_b[:, None] * across)
    points = np.zeros_like(rays.points)
    for corner, (right, down) in enumerate(((-1, -1), (1, -1), (-1, 1), (1, 1))):
        np.add.at(points, corners[:, corner], 0.5 * (right * by_across + down * by_along))
    weights = np.zeros_like(rays.weight)
    for corner in range(4):
        np.add.at(weights, corners[:, corner], value * (ratio - mean) / total)
    return Slopes(value, None, weights * share, points)


SMOOTH: dict[str, Callable[..., Slopes]] = {
    "aoap": smooth_aoap,
    "2to3pw": smooth_projection_warping,
    "coverage": smooth_coverage,
    "distortion": smooth_distortion,
}
"""Smoothed objectives by name. Settings of the objective that affect them are keyword arguments."""


class _PixelTriangles:
    """Two triangles for each quad of pixels; only triangles whose three corners take the same path.

    Attributes:
        area: (t,) area, mm².
        weight: (t,) 1 plus the sum over the three corners of 2 (w - 1) / m, with w the weight of
            the corner's ray and m the number of triangles that it belongs to.
    """

    def __init__(self, rays: DifferentiableRays) -> None:
        self._rays = rays
        self._corners = corners = _same_way(rays.codes)
        self._places = tuple(rays.points[corners[:, k]] for k in range(3))
        a, b, c = self._places
        cross = np.cross(b - a, c - a)
        length = np.linalg.norm(cross, axis=1)
        self._unit = cross / np.maximum(length, 1e-30)[:, None]
        self.area = 0.5 * length
        count = np.bincount(corners.ravel(), minlength=len(rays.weight))
        # A pixel stands for two triangles; this is the share of them for each of the ray's
        # triangles.
        self._share = 2.0 / np.maximum(count, 1)
        self.weight = 1.0 + ((rays.weight - 1.0) * self._share)[corners].sum(axis=1)

    def mean_of_corners(self, values: FloatArray) -> FloatArray:
        """Return the means (t,) over triangles' corners of values of rays (k,)."""
        mean: FloatArray = values[self._corners].mean(axis=1)
        return mean

    def by_points(self, by_area: FloatArray) -> FloatArray:
        """Return the derivatives (k, 3) of a number with respect to rays' points, given those with
        respect to areas (t,).
        """
        points = np.zeros_like(self._rays.points)
        a, b, c = self._places
        for own, first, second in ((0, b, c), (1, c, a), (2, a, b)):
            # The area grows with a corner's distance from the opposite side, by half that side's
            # length.
            slope = by_area[:, None] * 0.5 * np.cross(self._unit, second - first)
            np.add.at(points, self._corners[:, own], slope)
        return points

    def by_weight(self, by_weight: FloatArray) -> FloatArray:
        """Return the derivatives (k,) of a number with respect to rays' weights, given those with
        respect to triangles' weights (t,).
        """
        weights = np.zeros_like(self._rays.weight)
        for own in range(3):
            np.add.at(weights, self._corners[:, own], by_weight)
        return weights * self._share


def _quads(codes: NDArray[np.uint32]) -> NDArray[np.int64]:
    """Return the numbers (q, 4) of arriving rays in quads of neighbours with the same path."""
    corners, ways = _corners(codes)
    same = (ways[0] > 0) & (ways == ways[0]).all(axis=0)
    return corners[:, same].T


def _same_way(codes: NDArray[np.uint32]) -> NDArray[np.int64]:
    """Return the numbers (t, 3) of arriving rays in triangles of neighbours with the same path."""
    corners, ways = _corners(codes)
    found = []
    for half in ([0, 1, 2], [3, 2, 1]):
        same = (ways[half[0]] > 0) & (ways[half] == ways[half[0]]).all(axis=0)
        found.append(corners[half][:, same].T)
    return np.concatenate(found)


def _corners(codes: NDArray[np.uint32]) -> tuple[NDArray[np.int64], NDArray[np.uint32]]:
    """Return the numbers (4, n) of arriving rays at the corners of all quads of pixels (upper left,
    upper right, lower left, lower right), and the codes (4, n) of their paths.
    """
    number = np.cumsum(codes.ravel() > 0, dtype=np.int64).reshape(codes.shape) - 1
    rows, columns = codes.shape
    boxes = [
        (slice(down, rows - 1 + down), slice(right, columns - 1 + right))
        for down in (0, 1)
        for right in (0, 1)
    ]
    numbers = np.stack([number[box].ravel() for box in boxes])
    return numbers, np.stack([codes[box].ravel() for box in boxes])
