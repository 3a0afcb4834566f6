"""Interpolation of every second pixel of an image where it is smooth.

Away from contacts the light varies over many pixels. Where it saves time, pixels with even row and
column are shaded, and another pixel becomes the mean of the two or four beside it, if its chief ray
runs between theirs and if they agree.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from optisense.array_types import BoolArray, FloatingArray
from optisense.optics.scene.surfaces import Region
from optisense.optics.transport.chief_rays import ChiefRays

MAX_OFFSET = 0.2
"""Largest distance of a pixel's surface point from the centre of its neighbours' points, relative
to the distance of those points from the centre. On a smooth skin it is nearly 0; a distance of a
fifth or more indicates an edge."""
MIN_COSINE = 0.995
"""Smallest cosine (6 degrees) between a pixel's normal and ray and those of the pixels beside it:
neighbours on a smooth skin differ by less."""
AGREEMENT = 0.1
"""Largest difference in the total light of the neighbours of a pixel at which it is interpolated,
relative to their mean or to `DIM` times the image's mean. The interpolated value is then off by a
few per cent at most; measured errors do not change (benchmarks/ablation.md)."""
GROUP_AGREEMENT = 0.3
"""Largest difference, as in `AGREEMENT`, in the light of a single group, which is noisier, as only
a part of the photons is its own."""
DIM = 0.3
"""Fraction of the image's mean below which differences are measured against that mean, as those of
dark pixels are hardly visible."""


def between_rays(rays: ChiefRays, where: BoolArray) -> BoolArray:
    """Return the mask (h, w) of the pixels of a mask ``where`` (h, w) that see the undeformed
    surface between the places of their even neighbours, which must be in ``where`` as well.
    """
    plain = where & rays.hit & (rays.region == Region.SENSING)
    out = np.zeros_like(plain)
    for odd, corners in _places(plain):
        points, normals, ways = (
            (values[odd], np.stack([values[c] for c in corners]))
            for values in (rays.points, rays.normals, rays.directions)
        )
        middle = points[1].mean(axis=0)
        reach = np.linalg.norm(points[1] - middle, axis=-1).max(axis=0)
        between = np.linalg.norm(points[0] - middle, axis=-1) <= MAX_OFFSET * reach
        for here, beside in (normals, ways):
            between &= (np.einsum("yxk,nyxk->nyx", here, beside) > MIN_COSINE).all(axis=0)
        out[odd] = between & plain[odd] & np.all([plain[c] for c in corners], axis=0)
    return out


def agreed(layers: FloatingArray, where: BoolArray) -> BoolArray:
    """Return the mask (h, w) of the pixels of a mask ``where`` (h, w) whose even neighbours agree
    in their light ``layers`` (groups, h, w, 3).
    """
    groups = layers.sum(axis=-1)
    out = where.copy()
    for light, bound in ((groups.sum(axis=0)[None], AGREEMENT), (groups, GROUP_AGREEMENT)):
        dim = DIM * light[:, ::2, ::2].mean(axis=(1, 2))[:, None, None]
        for odd, corners in _places(where):
            beside = np.stack([light[:, y, x] for y, x in corners])
            spread = beside.max(axis=0) - beside.min(axis=0)
            same = spread <= bound * np.maximum(beside.mean(axis=0), dim)
            out[odd] &= same.all(axis=0)
    out[::2, ::2] = False
    return out


def fill(layers: NDArray[np.float32], where: BoolArray) -> None:
    """Replace pixels of a mask in ``layers`` (groups, h, w, 3) by the mean of even neighbours."""
    for odd, corners in _places(where):
        mean = sum(layers[:, c[0], c[1]] for c in corners) / np.float32(len(corners))
        layers[:, odd[0], odd[1]] = np.where(where[odd][..., None], mean, layers[:, odd[0], odd[1]])


Place = tuple[slice, slice]


def _places(image: NDArray[np.generic]) -> Iterator[tuple[Place, list[Place]]]:
    """Yield slices of pixels with odd column, odd row, or both, and of the even ones beside."""
    height, width = ((size + 1) // 2 for size in image.shape)
    for down, right in ((0, 1), (1, 0), (1, 1)):
        rows, columns = height - down, width - right
        corners = [
            (slice(2 * y, 2 * (y + rows), 2), slice(2 * x, 2 * (x + columns), 2))
            for y in range(down + 1)
            for x in range(right + 1)
        ]
        yield (slice(down, down + 2 * rows, 2), slice(right, right + 2 * columns, 2)), corners
