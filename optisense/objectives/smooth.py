"""Scores by chief rays as smooth functions of these, with their derivatives.

The scores themselves jump when a ray begins or ceases to arrive. Here each ray has a weight, the
area of the picture that it stands for, which changes smoothly when the boundary beside it moves
(`OpticalModel.differentiable_rays`), and the sums are weighted. AOAP's coverage, which counts the
triangles seen, becomes the integral of their number for each mm² over what is seen.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from optisense.objectives.aoap import COVERAGE_WEIGHT
from optisense.objectives.distortion import MOST_ANISOTROPY
from optisense.objectives.projection_warping import MOST_EVEN

FloatArray = NDArray[np.float64]


class Rays(Protocol):
    """Chief rays of a picture.

    Attributes:
        codes: (h, w) 0 where a ray does not arrive; neighbours of one number arrive the same way.
        cosine: (k,) of those that arrive, row after row: between ray and normal.
        weight: (k,) pixels that each stands for.
        points: (k, 3) mm, where they arrive.
        density: (k,) 1/mm², the part of the surface's triangles that lies in one mm² there.
    """

    @property
    def codes(self) -> NDArray[np.uint32]: ...
    @property
    def cosine(self) -> FloatArray: ...
    @property
    def weight(self) -> FloatArray: ...
    @property
    def points(self) -> FloatArray: ...
    @property
    def density(self) -> FloatArray: ...


class Slopes(NamedTuple):
    """A smoothed score, and its derivatives by what rays do; None where it does not depend."""

    value: float
    cosine: FloatArray | None
    weight: FloatArray
    points: FloatArray | None


def smooth_aoap(rays: Rays, *, coverage_weight: float = COVERAGE_WEIGHT) -> Slopes:
    """The mean over all pixels of weight times cosine between ray and normal, and k1 times the part
    of the surface's triangles that are seen.
    """
    count = rays.codes.size
    seen = smooth_coverage(rays)
    value = float((rays.cosine * rays.weight).sum() / count) + coverage_weight * seen.value
    by_weight = rays.cosine / count + coverage_weight * seen.weight
    assert seen.points is not None
    return Slopes(value, rays.weight / count, by_weight, coverage_weight * seen.points)


def smooth_coverage(rays: Rays) -> Slopes:
    """The part of the surface's triangles that are seen, as the integral of their number for each
    mm² over what is seen.
    """
    triangles = _PixelTriangles(rays)
    density = triangles.mean_of_corners(rays.density)
    value = float((density * triangles.weight * triangles.area).sum())
    # What lies within the view is seen before and after, however the points on it move: only where
    # points at its border move does more come into view. Around all others these sums vanish.
    by_points = rays.density[:, None] * triangles.by_points(triangles.weight)
    return Slopes(value, None, triangles.by_weight(density * triangles.area), by_points)


def smooth_projection_warping(rays: Rays) -> Slopes:
    """Weighted mean over weighted standard deviation of the areas between neighbouring pixels'
    points.
    """
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


def smooth_distortion(rays: Rays) -> Slopes:
    """The weighted geometric mean of the anisotropies of footprints between four neighbours."""
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
    # footprints have no slope, and grazing ones the largest ratio that the score knows.
    least = (1.0 - 2.0 / (1.0 + MOST_ANISOTROPY**2)) * middle
    inner = np.minimum(apart, least)
    ratio = 0.5 * np.log((middle + inner) / np.maximum(middle - inner, 1e-300))
    count = np.bincount(corners.ravel(), minlength=len(rays.weight))
    # Footprints that a ray has, as a part of the one that a pixel stands for.
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
"""Smoothed objectives by name. Settings of the objective that count here are keyword arguments."""


class _PixelTriangles:
    """Two triangles for each quad of pixels, where all three corners arrive the same way.

    Attributes:
        area: (t,) mm².
        weight: (t,) 1, and more or less by the weights of its corners: where rays weigh so many
            pixels more, their triangles weigh as much more as the two triangles that a pixel has.
    """

    def __init__(self, rays: Rays) -> None:
        self._rays = rays
        self._corners = corners = _same_way(rays.codes)
        self._places = tuple(rays.points[corners[:, k]] for k in range(3))
        a, b, c = self._places
        cross = np.cross(b - a, c - a)
        length = np.linalg.norm(cross, axis=1)
        self._unit = cross / np.maximum(length, 1e-30)[:, None]
        self.area = 0.5 * length
        count = np.bincount(corners.ravel(), minlength=len(rays.weight))
        # Triangles that a ray has, as a part of the two that a pixel stands for.
        self._share = 2.0 / np.maximum(count, 1)
        self.weight = 1.0 + ((rays.weight - 1.0) * self._share)[corners].sum(axis=1)

    def mean_of_corners(self, values: FloatArray) -> FloatArray:
        """(t,) from values of rays (k,)."""
        mean: FloatArray = values[self._corners].mean(axis=1)
        return mean

    def by_points(self, by_area: FloatArray) -> FloatArray:
        """(k, 3) derivatives of a number by rays' points, given those by areas (t,)."""
        points = np.zeros_like(self._rays.points)
        a, b, c = self._places
        for own, first, second in ((0, b, c), (1, c, a), (2, a, b)):
            # An area grows with a corner's way from the opposite side, by half that side's length.
            slope = by_area[:, None] * 0.5 * np.cross(self._unit, second - first)
            np.add.at(points, self._corners[:, own], slope)
        return points

    def by_weight(self, by_weight: FloatArray) -> FloatArray:
        """(k,) derivatives of a number by rays' weights, given those by triangles' (t,)."""
        weights = np.zeros_like(self._rays.weight)
        for own in range(3):
            np.add.at(weights, self._corners[:, own], by_weight)
        return weights * self._share


def _quads(codes: NDArray[np.uint32]) -> NDArray[np.int64]:
    """(q, 4) numbers of arriving rays: four neighbours that arrive the same way, row by row."""
    number = np.cumsum(codes.ravel() > 0).reshape(codes.shape) - 1
    before, after = slice(None, -1), slice(1, None)
    corners = [(before, before), (before, after), (after, before), (after, after)]
    first = codes[:-1, :-1]
    same = (first > 0) & np.logical_and.reduce([first == codes[each] for each in corners])
    return np.stack([number[each][same] for each in corners], axis=1).astype(np.int64)


def _same_way(codes: NDArray[np.uint32]) -> NDArray[np.int64]:
    """(t, 3) numbers of arriving rays."""
    hit = codes > 0
    number = np.full(codes.shape, -1, dtype=np.int64)
    number[hit] = np.arange(int(hit.sum()))

    def corners(values: NDArray[np.generic]) -> list[NDArray[np.generic]]:
        here, right = values[:-1, :-1], values[:-1, 1:]
        below, across = values[1:, :-1], values[1:, 1:]
        halves = np.stack([here, right, below]), np.stack([across, below, right])
        return [half.reshape(3, -1).T for half in halves]

    rays = np.concatenate(corners(number))
    ways = np.concatenate(corners(codes))
    same = (ways[:, 0] > 0) & (ways[:, 0] == ways[:, 1]) & (ways[:, 0] == ways[:, 2])
    return rays[same].astype(np.int64)
