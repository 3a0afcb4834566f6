"""Markers (dots on the skin): their coverage of pixels and their positions in pictures."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.spatial import cKDTree

from optisense.array_types import FloatArray
from optisense.design.markers import Markers
from optisense.design.materials import CoatingModel
from optisense.design.materials.base import GEL_INDEX
from optisense.design.reflectance import fresnel_metal
from optisense.errors import ContactError
from optisense.geometry import SensingSurface

if TYPE_CHECKING:
    from optisense.optics.transport.chief_rays import ChiefRays

FARTHEST = 1.5
"""Distance of a dot from the nearest pixel's place on the skin, in widths of a pixel, from which on
it counts as unseen."""
DEEPEST_MISS = 1.0
"""Largest distance (mm) of a pixel's place from the skin at a dot, along its normal. Places in
contacts of a conforming skin, which has no known displacement, are off the skin; those on the other
side of a thin sensor must not count."""


@dataclass(frozen=True, eq=False)
class MarkerPlaces:
    """Positions of the markers in a picture.

    Attributes:
        coordinates: (n, 2) u, v on the undeformed surface, mm; markers beyond its edge are absent.
        before: (n, 2) column and row in the untouched sensor's picture, in pixels from its upper
            left corner; NaN where it is not seen.
        after: (n, 2) column and row in the picture with the contacts; NaN where it is not seen.
        displacement: (n, 3) displacement (mm) of each marker in the design's frame; NaN if unseen.
    """

    coordinates: FloatArray
    before: FloatArray
    after: FloatArray
    displacement: FloatArray

    def rows(self) -> NDArray[np.float32]:
        """Return an array (n, 4) of column and row before, and column and row after."""
        return np.hstack([self.before, self.after]).astype(np.float32)


@dataclass(frozen=True, eq=False)
class MarkerDots:
    """The markers of a design on its skin: (n, 2) coordinates, (n, 3) points and normals."""

    coordinates: FloatArray
    points: FloatArray
    normals: FloatArray
    radius: float

    @classmethod
    def on(cls, markers: Markers, surface: SensingSurface) -> MarkerDots:
        """Return the dots that lie on the surface; those beyond its edge are left out."""
        kept, points, normals = [], [], []
        for u, v in markers.coordinates():
            try:
                spot = surface.point_at(u, v)
            except ContactError:
                continue
            kept.append((u, v))
            points.append(spot.point)
            normals.append(spot.inward)
        shape = (-1, 3)
        return cls(
            np.array(kept, dtype=np.float64).reshape(-1, 2),
            np.array(points, dtype=np.float64).reshape(shape),
            np.array(normals, dtype=np.float64).reshape(shape),
            markers.radius,
        )

    def coverage(self, material: FloatArray) -> FloatArray:
        """Return the share (h, w) of each pixel that a dot covers.

        Args:
            material: (h, w, 3) position (mm) of the skin behind each pixel before it moved.
        """
        result = np.zeros(material.shape[:2])
        if not len(self.points):
            return result
        seen = np.isfinite(material).all(axis=2)
        where = material[seen]
        _, nearest = cKDTree(self.points).query(where)
        offset = where - self.points[nearest]
        along = np.einsum("ni,ni->n", offset, self.normals[nearest])
        beside = np.sqrt(np.maximum(np.einsum("ni,ni->n", offset, offset) - along**2, 0.0))
        width = np.maximum(_pixel_width(material)[seen], 1e-9)
        share = _covered(self.radius / width, beside / width)
        result[seen] = np.where(np.abs(along) < DEEPEST_MISS, share, 0.0)
        return result

    def pixels(self, material: FloatArray) -> FloatArray:
        """Return the column and row (n, 2) at which each dot is seen; NaN where it is not seen."""
        result = np.full((len(self.points), 2), np.nan)
        seen = np.isfinite(material).all(axis=2)
        if not seen.any() or not len(self.points):
            return result
        rows, columns = np.nonzero(seen)
        away, nearest = cKDTree(material[seen]).query(self.points)
        width = _pixel_width(material)
        height, across = seen.shape
        for number, (distance, pixel) in enumerate(zip(away, nearest, strict=True)):
            row, column = int(rows[pixel]), int(columns[pixel])
            if not distance <= FARTHEST * width[row, column]:
                continue
            left, right = max(column - 1, 0), min(column + 1, across - 1)
            up, down = max(row - 1, 0), min(row + 1, height - 1)
            by_column = (material[row, right] - material[row, left]) / (right - left)
            by_row = (material[down, column] - material[up, column]) / (down - up)
            slopes = np.column_stack([by_column, by_row])
            step = np.zeros(2)
            if np.isfinite(slopes).all():
                rest = self.points[number] - material[row, column]
                step = np.linalg.lstsq(slopes, rest, rcond=None)[0].clip(-1.0, 1.0)
            result[number] = column + 0.5 + step[0], row + 0.5 + step[1]
        return result

    def places(self, untouched: ChiefRays, material: FloatArray, moved: FloatArray) -> MarkerPlaces:
        """Return the positions of the dots before and after the contacts.

        Args:
            untouched: chief rays of the untouched sensor.
            material: (h, w, 3) position (mm) of the skin before it moved, as in `coverage`.
            moved: (h, w, 3) displacement (mm) of the skin behind each pixel.
        """
        at_rest = np.where(untouched.hit[..., None], untouched.points, np.nan).astype(np.float64)
        after = self.pixels(material)
        displacement = np.full((len(self.points), 3), np.nan)
        known = np.isfinite(after).all(axis=1)
        displacement[known] = _between_pixels(moved, after[known])
        return MarkerPlaces(self.coordinates, self.pixels(at_rest), after, displacement)


def off_skin_notes(markers: Markers, on_skin: FloatArray) -> list[str]:
    """Return a note on the markers that lie off the skin; none if all lie on it.

    Args:
        on_skin: (n, 2) coordinates of those on it, as of `MarkerDots`.
    """
    every = len(markers.coordinates())
    off = every - len(on_skin)
    if off == 0:
        return []
    lie = "lies" if off == 1 else "lie"
    return [f"{off} of {every} markers {lie} off the sensing surface, and no picture has them"]


def ink_factor(markers: Markers, coating: CoatingModel) -> FloatArray:
    """Return the ratio (3,) of the reflectance of a dot's ink to that of the coating at normal
    incidence, for R, G, B.

    Dots darken light by this factor. For a diffuse coating this is exact except for
    interreflection.
    """
    lobe = coating.reflection()
    diffuse = np.array(lobe.reflectance)
    metal = fresnel_metal(
        np.array(1.0), np.array(lobe.eta) / GEL_INDEX, np.array(lobe.k) / GEL_INDEX
    )
    share = lobe.specularity
    own = (1.0 - share) * diffuse + (share * metal if share > 0.0 else 0.0)
    return np.asarray(np.array(markers.reflectance) / np.maximum(own, 1e-6))


def _covered(radius: FloatArray, beside: FloatArray) -> FloatArray:
    """Return the share (n,) of pixels that a dot covers, from its radius and the distance of its
    middle from that of the pixel, both in widths of the pixel.

    The share falls linearly over the width of a pixel. Such an edge at the radius R holds the area
    pi (R^2 + 1/12), so that it lies a little inside the dot; a dot with a radius below 3^-1/2
    covers no pixel wholly. The sum over pixels is the area of the dot in each case.
    """
    edge = 0.5 + np.sqrt(np.maximum(radius**2 - 1.0 / 12.0, 0.0)) - beside
    within_a_pixel = 3.0 * radius**2 * (1.0 - beside)
    return np.asarray(np.clip(np.where(radius < 3.0**-0.5, within_a_pixel, edge), 0.0, 1.0))


def _between_pixels(values: FloatArray, places: FloatArray) -> FloatArray:
    """Interpolate a map (h, w, k) at columns and rows (n, 2); beside gaps, take the nearest."""
    upright = np.moveaxis(values, 2, 0)
    spots = places[:, ::-1].T - 0.5
    found = [
        [ndimage.map_coordinates(each, spots, order=order, mode="nearest") for each in upright]
        for order in (1, 0)
    ]
    smooth, nearest = (np.array(each).T for each in found)
    return np.asarray(np.where(np.isfinite(smooth), smooth, nearest))


def _pixel_width(material: FloatArray) -> FloatArray:
    """Return the side (h, w), mm, of the patch of skin behind each pixel; 0 where it is unknown."""
    along = np.gradient(material, axis=1)
    down = np.gradient(material, axis=0)
    area = np.linalg.norm(np.cross(along, down), axis=2)
    return np.asarray(np.nan_to_num(np.sqrt(area)))
