"""View of the skin by a camera, and the outline of the skin in its pictures.

A rendered pixel shows what its chief ray meets. Photographs are averages of smaller pixels, so that
the outline of the skin, such as the edge of a small mirror, is smooth, and shows displacements of a
fraction of a pixel. Photographs that were reduced in size are averages of levels, not of light. If
half of a pixel sees a bright skin beside darkness, a tone curve of exponent 1/1.8 gives it 0.5 of
the skin's level then, and 0.68 if its light was averaged.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

from optisense.array_types import FloatArray

if TYPE_CHECKING:
    from optisense.optics import ChiefRays, OpticalModel

FloatType = TypeVar("FloatType", np.float32, np.float64)

COVERAGE_RAYS = 8
"""Number of chief rays across a pixel by which its coverage is determined. Where an edge of a
mirror runs along a column of pixels, the coverage changes in steps of an eighth."""


@dataclass(frozen=True)
class CoveredView:
    """View of the skin by a camera.

    Attributes:
        rays: chief rays of the pixels' middles.
        coverage: share (h, w) of each pixel that sees skin.
    """

    rays: ChiefRays
    coverage: FloatArray

    @classmethod
    def of(cls, model: OpticalModel, size: tuple[int, int]) -> CoveredView:
        """Return the view by a model's camera, in a picture of width and height `size`."""
        width, height = size
        rays = model.chief_rays(size)
        if rays.hit.all():
            return cls(rays, np.ones((height, width)))
        fine = model.chief_rays((width * COVERAGE_RAYS, height * COVERAGE_RAYS)).hit
        parts = fine.reshape(height, COVERAGE_RAYS, width, COVERAGE_RAYS)
        return cls(rays, parts.mean(axis=(1, 3)))


@dataclass(frozen=True)
class SkinOutline:
    """Pixels that see skin in part, and those that see none.

    Attributes:
        where: mask (h, w) of the n pixels that see skin in part.
        outside: mask (h, w) of those that see none.
        skin: rows and columns (2, h, w) of the nearest pixels that see nothing but skin.
        rest: rows and columns (2, h, w) of the nearest pixels that see no skin.
    """

    where: NDArray[np.bool_]
    outside: NDArray[np.bool_]
    skin: NDArray[np.int32]
    rest: NDArray[np.int32]

    def continued(self, layers: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return layers (groups, h, w, 3) in which the nearest skin replaces all other pixels."""
        return layers[:, self.skin[0], self.skin[1]]

    def contrast(self, layers: NDArray[FloatType]) -> NDArray[FloatType]:
        """Return the difference (groups, n, 3) between skin and rest at the pixels of `where`."""
        (row, column), (other_row, other_column) = (
            each[:, self.where] for each in (self.skin, self.rest)
        )
        return layers[:, row, column] - layers[:, other_row, other_column]


def outline_of(*coverages: FloatArray) -> SkinOutline | None:
    """Return the pixels that see skin in part by any of several coverages (h, w), or None if all
    pixels see skin, or none does.
    """
    inside, outside = np.minimum.reduce(coverages) == 1.0, np.maximum.reduce(coverages) == 0.0
    if not (inside.any() and outside.any()):
        return None
    return SkinOutline(~inside & ~outside, outside, _nearest(inside), _nearest(outside))


def with_smooth_outline(
    layers: NDArray[FloatType], coverage: FloatArray, outline: SkinOutline | None = None
) -> NDArray[FloatType]:
    """Return layers (groups, h, w, 3) of radiance or of levels, whose pixels at the outline are
    averages of skin and rest by the coverage (h, w). The outline is that of the coverage by
    default.
    """
    outline = outline or outline_of(coverage)
    if outline is None:
        return layers
    found = layers.copy()
    share = coverage[outline.where, None].astype(layers.dtype)
    row, column = outline.rest[:, outline.where]
    rest = layers[:, row, column]
    found[:, outline.where] = rest + share * outline.contrast(layers)
    return found


def _nearest(where: NDArray[np.bool_]) -> NDArray[np.int32]:
    """Return rows and columns (2, h, w) of the pixel of a mask that is nearest to each pixel."""
    return np.asarray(distance_transform_edt(~where, return_distances=False, return_indices=True))
