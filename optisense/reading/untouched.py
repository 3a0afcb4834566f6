"""The untouched sensing surface that each pixel sees, and depths below it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from optisense.array_types import FloatArray

if TYPE_CHECKING:
    from optisense.optics import ChiefRays, TactileImage

UNMOVED = 1e-4
"""Displacement (mm) below which a surface counts as unmoved; smaller values are rounding of single
precision and the error of the tangent plane on a curved surface."""


@dataclass(frozen=True, eq=False)
class UntouchedSurface:
    """The camera's view of an untouched sensor, in the design's frame.

    Attributes:
        points: (h, w, 3) points of the surface, mm.
        normals: (h, w, 3) unit normals into the gel.
        directions: (h, w, 3) unit directions of the rays on arrival.
        seen: (h, w) mask of the pixels with valid entries.
    """

    points: FloatArray
    normals: FloatArray
    directions: FloatArray
    seen: NDArray[np.bool_]

    @classmethod
    def of(cls, rays: ChiefRays) -> UntouchedSurface:
        """Return the view of chief rays without contacts."""
        return cls(
            points=rays.points.astype(np.float64),
            normals=rays.normals.astype(np.float64),
            directions=rays.directions.astype(np.float64),
            seen=rays.hit,
        )

    @cached_property
    def _tree(self) -> cKDTree:
        return cKDTree(self.points[self.seen])

    def depth(self, points: NDArray[np.floating]) -> FloatArray:
        """Return the depth (mm) of points below the surface, along its inward normal.

        It is measured from the tangent plane at the nearest point that a pixel sees. On a surface
        of radius R with pixels of size p, the error is at most p^2 / (4 R), less than a
        ten-thousandth of a mm.

        Args:
            points: (..., 3) points, mm; NaN gives NaN.

        Returns:
            The depth (...), mm; negative above the surface.
        """
        flat = np.asarray(points, dtype=np.float64).reshape(-1, 3)
        known = np.isfinite(flat).all(axis=1)
        depth = np.full(len(flat), np.nan)
        _, nearest = self._tree.query(flat[known])
        below = flat[known] - self.points[self.seen][nearest]
        depth[known] = np.einsum("ij,ij->i", below, self.normals[self.seen][nearest])
        return depth.reshape(np.shape(points)[:-1])

    def image_depth(self, image: TactileImage) -> NDArray[np.float32]:
        """Return the depth (h, w), mm, of an image's coating below the untouched surface, NaN where
        unseen.

        It is 0 where the coating has not moved, and negative where an elastic skin bulges.
        """
        depth = self.depth(image.points)
        depth[np.abs(depth) < UNMOVED] = 0.0
        inside = image.contact_mask
        depth[inside] = np.maximum(depth[inside], 0.0)
        return depth.astype(np.float32)
