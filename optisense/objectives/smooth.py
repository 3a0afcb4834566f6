"""AOAP and 2to3PW as smooth functions of chief rays, with their derivatives.

The scores themselves jump when a ray begins or ceases to arrive. Here each ray has a weight that
fades towards open edges (`OpticalModel.differentiable_rays`), and the sums are weighted; AOAP's
coverage, which counts triangles, is left out.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from optisense.objectives.projection_warping import MOST_EVEN

FloatArray = NDArray[np.float64]


class Rays(Protocol):
    """Rays that arrive, in the order of `hit`: (h, w) bool, (k,), (k,), (k, 3) mm."""

    @property
    def hit(self) -> NDArray[np.bool_]: ...
    @property
    def cosine(self) -> FloatArray: ...
    @property
    def weight(self) -> FloatArray: ...
    @property
    def points(self) -> FloatArray: ...


class Slopes(NamedTuple):
    """A smoothed score, and its derivatives by what rays do; None where it does not depend."""

    value: float
    cosine: FloatArray | None
    weight: FloatArray
    points: FloatArray | None


def smooth_aoap(rays: Rays) -> Slopes:
    """The mean over all pixels of weight times cosine between ray and normal."""
    count = rays.hit.size
    value = float((rays.cosine * rays.weight).sum() / count)
    return Slopes(value, rays.weight / count, rays.cosine / count, None)


def smooth_projection_warping(rays: Rays) -> Slopes:
    """Weighted mean over weighted standard deviation of the areas between neighbouring pixels'
    points; a triangle weighs the product of its corners' weights.
    """
    corners = _pixel_triangles(rays.hit)
    if len(corners) < 2:
        return Slopes(0.0, None, np.zeros_like(rays.weight), None)
    a, b, c = (rays.points[corners[:, k]] for k in range(3))
    cross = np.cross(b - a, c - a)
    length = np.linalg.norm(cross, axis=1)
    area = 0.5 * length
    shares = rays.weight[corners]
    weight = shares.prod(axis=1)
    total = max(float(weight.sum()), 1e-12)
    mean = float((weight * area).sum()) / total
    variance = float((weight * (area - mean) ** 2).sum()) / total
    spread = max(np.sqrt(variance), MOST_EVEN * mean)

    by_mean, by_spread = 1.0 / spread, -mean / spread**2
    off = area - mean
    by_area = weight / total * (by_mean + by_spread * off / spread)
    by_weight = (by_mean * off + by_spread * (off**2 - variance) / (2 * spread)) / total

    unit = cross / np.maximum(length, 1e-30)[:, None]
    points = np.zeros_like(rays.points)
    for own, first, second in ((0, b, c), (1, c, a), (2, a, b)):
        # An area grows with a corner's way from the opposite side, by half that side's length.
        np.add.at(points, corners[:, own], by_area[:, None] * 0.5 * np.cross(unit, second - first))
    weights = np.zeros_like(rays.weight)
    for own, (one, other) in enumerate(((1, 2), (2, 0), (0, 1))):
        np.add.at(weights, corners[:, own], by_weight * shares[:, one] * shares[:, other])
    return Slopes(mean / spread, None, weights, points)


SMOOTH: dict[str, Callable[[Rays], Slopes]] = {
    "aoap": smooth_aoap,
    "2to3pw": smooth_projection_warping,
}
"""By the name of the objective."""


def _pixel_triangles(hit: NDArray[np.bool_]) -> NDArray[np.int64]:
    """(t, 3) numbers of arriving rays: two triangles for each quad of pixels, where all three
    corners arrive.
    """
    number = np.full(hit.shape, -1, dtype=np.int64)
    number[hit] = np.arange(int(hit.sum()))
    here, right, below, across = number[:-1, :-1], number[:-1, 1:], number[1:, :-1], number[1:, 1:]
    upper = np.stack([here, right, below], axis=-1).reshape(-1, 3)
    lower = np.stack([across, below, right], axis=-1).reshape(-1, 3)
    both = np.concatenate([upper, lower])
    return both[(both >= 0).all(axis=1)]
