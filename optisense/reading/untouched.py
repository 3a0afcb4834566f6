"""The untouched sensing surface behind each pixel, and how deep a touched one lies below it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

if TYPE_CHECKING:
    from optisense.optics import ChiefRays, TactileImage

FloatArray = NDArray[np.float64]

UNMOVED = 1e-4
"""mm; smaller displacements than these are rounding of single precision, and the tangent plane in
place of a curved surface."""


@dataclass(frozen=True)
class UntouchedSurface:
    """The camera's view of a sensor that nothing touches; arrays are (h, w, ...).

    points: mm. normals: unit, inward. directions: unit, of the ray that arrives. seen: (h, w),
    where the other three count. Everything is in the design's frame.
    """

    points: FloatArray
    normals: FloatArray
    directions: FloatArray
    seen: NDArray[np.bool_]

    @classmethod
    def of(cls, rays: ChiefRays) -> UntouchedSurface:
        """The view along chief rays without contacts."""
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
        """How far (mm) points lie below the surface, along its inward normal.

        Measured from the tangent plane at the nearest point that a pixel sees: on a surface of
        radius R and pixels of p mm it is exact to p^2 / (4 R), less than a ten-thousandth of a mm.

        Args:
            points: (..., 3) mm; NaN gives NaN.

        Returns:
            (...) mm; negative above the surface.
        """
        flat = np.asarray(points, dtype=np.float64).reshape(-1, 3)
        known = np.isfinite(flat).all(axis=1)
        depth = np.full(len(flat), np.nan)
        _, nearest = self._tree.query(flat[known])
        below = flat[known] - self.points[self.seen][nearest]
        depth[known] = np.einsum("ij,ij->i", below, self.normals[self.seen][nearest])
        return depth.reshape(np.shape(points)[:-1])

    def image_depth(self, image: TactileImage) -> NDArray[np.float32]:
        """(h, w) mm that an image's coating is pushed in, NaN where unseen.

        It is 0 where the coating has not moved, and negative where an elastic skin bulges.
        """
        depth = self.depth(image.points)
        depth[np.abs(depth) < UNMOVED] = 0.0
        inside = image.contact_mask
        depth[inside] = np.maximum(depth[inside], 0.0)
        return depth.astype(np.float32)

    def frames(self, right: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Two unit tangents of the surface at each pixel, square to each other: (h, w, 3) each.

        Args:
            right: (3,) the first tangent is this direction made to lie in the surface.
        """
        along = right - (self.normals @ right)[..., None] * self.normals
        with np.errstate(invalid="ignore"):
            first = along / np.linalg.norm(along, axis=2, keepdims=True)
        second = np.cross(first, self.normals)
        return first, second
