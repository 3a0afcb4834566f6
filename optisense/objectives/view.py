"""The share of the sensing surface that a camera sees, which every score depends on.

A grid of equal cells divides the surface into pieces. Each pixel sees the parallelogram on the
surface that is spanned by half the way to its neighbours' points. A piece is seen if pixels cover
most of its area. The result depends neither on the sizes of the mesh's triangles nor on how many
pixels or mirrors see the same place.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from optisense.array_types import FloatArray, FloatingArray
from optisense.errors import ObjectiveError
from optisense.geometry import TriangleMesh
from optisense.geometry.mesh_points import surface_samples
from optisense.objectives._pixel_edges import JUMP, discontinuous_edges
from optisense.objectives.settings import Settings
from optisense.percentages import told_apart

if TYPE_CHECKING:
    from optisense.optics import ChiefRays


@dataclass(frozen=True)
class View:
    """Measures of a camera's view of the untouched sensor.

    Attributes:
        picture: share of the pixels that see the sensing surface, 0 to 1.
        skin: share of the sensing surface's area that the pixels see, 0 to 1. It does not depend on
            the sizes of the mesh's triangles, and a place that is visible by two mirrors counts
            once.
    """

    picture: float
    skin: float

    def refuse_less(self, settings: Settings) -> None:
        """Raise ObjectiveError if the camera sees less than the settings require for a score."""
        if self.picture == 0.0:
            raise ObjectiveError(
                "the camera sees nothing of the sensing surface",
                hint="Check the camera's position, direction and field of view, and that the "
                "normals of the sensing surface point to its side",
            )
        for name, seen, least, what in (
            (
                "least_picture",
                self.picture,
                settings.least_picture,
                "of the pixels see the sensing surface",
            ),
            (
                "least_skin",
                self.skin,
                settings.least_skin,
                "of the sensing surface's area is seen",
            ),
        ):
            if seen < least:
                shown, needed = told_apart(seen, least)
                raise ObjectiveError(
                    f"only {shown} {what}, and a score needs {needed}",
                    hint="Check the camera's position, direction and field of view, or lower the "
                    f"setting '{name}'",
                )


def view_of(rays: ChiefRays, surface: TriangleMesh) -> View:
    """Return the view of chief rays.

    Args:
        rays: chief rays of the untouched sensor.
        surface: mesh of the sensing surface, mm.
    """
    return View(float(rays.hit.mean()), seen_area(rays, surface) / surface.area)


CELLS = 1000
"""Area of the surface over the square of a cell's side. With twice as many, the seen shares of the
built-in sensors change by less than 0.002, and take twice the time."""

SAMPLES_ACROSS = 6
"""Smallest number of samples of the surface, and of the footprints of pixels, along the side of a
cell. With six, the seen share is too small by a few thousandths of itself, as pieces of few samples
may get none of the footprints; with four, by 0.007."""

MOST_SAMPLES = 16
"""Largest number of samples along a side of a pixel's footprint, which bounds the memory. Longer
footprints than four cells are those of pixels that see the surface edge-on."""

CONTRAST = 2.0
"""Change of a piece's seen share by the share of its area that footprints cover, around a half. A
piece counts as whole from three quarters and as unseen up to one, so that inexact areas of pieces
inside the view and outside of it do not count. With 1 they would, and with more the sum would
change in larger steps when the view moves."""

TURN = Rotation.from_euler("xyz", [0.5, 0.7, 0.9]).as_matrix()
"""Rotation from the design's axes to the grid's. Flat surfaces and the borders of views are mostly
parallel to the design's axes; at three arbitrary angles (radians), no layer of cells coincides with
them."""


def seen_area(rays: ChiefRays, surface: TriangleMesh) -> float:
    """Return the area of the sensing surface that chief rays of the untouched sensor see, mm².

    Args:
        rays: chief rays of the untouched sensor.
        surface: mesh of the sensing surface, mm.
    """
    size = float(np.sqrt(surface.area / CELLS))
    points, _, areas = surface_samples(surface.vertices, surface.faces, size / SAMPLES_ACROSS)
    places = _places(points.T, size)
    low = places.min(axis=0) - 1
    # With a margin of one cell, for footprints that reach beyond the surface's border.
    shape = places.max(axis=0) - low + 2
    count = int(shape.prod())
    whole = np.bincount(_numbers(places, low, shape), areas, count)
    landings, shares = _footprint_samples(rays, size / SAMPLES_ACROSS)
    covered = np.bincount(_numbers(_places(landings, size), low, shape), shares, count)
    share = np.clip(0.5 + CONTRAST * (covered / np.maximum(whole, 1e-300) - 0.5), 0.0, 1.0)
    return float((share * whole).sum())


def _footprint_samples(rays: ChiefRays, spacing: float) -> tuple[FloatArray, FloatArray]:
    """Return points (k, 3), mm, spread over the footprints of all pixels at most by `spacing`, mm,
    and the area (k,) that each stands for, mm².
    """
    hit = rays.hit
    across, along = (_steps(rays, axis)[hit] for axis in (1, 0))
    area = _length(np.cross(across, along))
    columns, rows = (
        np.clip(np.ceil(_length(step) / spacing), 1, MOST_SAMPLES).astype(np.int64)
        for step in (across, along)
    )
    count = columns * rows
    pixel = np.repeat(np.arange(len(count)), count)
    number = np.arange(len(pixel)) - np.repeat(np.cumsum(count) - count, count)
    u = (number % columns[pixel] + 0.5) / columns[pixel] - 0.5
    v = (number // columns[pixel] + 0.5) / rows[pixel] - 0.5
    points = rays.points[hit][pixel] + u[:, None] * across[pixel] + v[:, None] * along[pixel]
    return points, (area / count)[pixel]


def _steps(rays: ChiefRays, axis: int) -> FloatingArray:
    """Return the way (h, w, 3), mm, on the surface across each pixel along an axis of the picture.

    It is that to the nearer of both neighbours whose rays the same surfaces reflect, without a
    leap over a gap or fold; 0 without such a neighbour.
    """
    points = np.moveaxis(rays.points, axis, 0)
    hit, codes = (np.moveaxis(each, axis, 0) for each in (rays.hit, rays.reflections))
    edges = points[1:] - points[:-1]
    parts = [np.ascontiguousarray(edges[..., k]) for k in range(3)]
    there = hit[1:] & hit[:-1] & (codes[1:] == codes[:-1])
    there &= ~discontinuous_edges(parts, there, 0, JUMP)
    length = np.full((len(points) + 1, *hit.shape[1:]), np.inf, dtype=np.float32)
    length[1:-1] = np.where(there, _length(edges), np.inf)
    steps = np.zeros_like(points)
    before = np.isfinite(length[:-1]) & (length[:-1] <= length[1:])
    after = np.isfinite(length[1:]) & ~before
    steps[1:][before[1:]] = edges[before[1:]]
    steps[:-1][after[:-1]] = edges[after[:-1]]
    return np.moveaxis(steps, 0, axis)


def _places(points: FloatingArray, size: float) -> NDArray[np.int64]:
    """Return the places (n, 3) in the grid of points (n, 3), mm."""
    return np.floor(points @ TURN / size).astype(np.int64)


def _numbers(
    places: NDArray[np.int64], low: NDArray[np.int64], shape: NDArray[np.int64]
) -> NDArray[np.int64]:
    """Return the numbers (n,) of places (n, 3) of a grid; those outside count as at its border."""
    x, y, z = np.clip(places - low, 0, shape - 1).T
    return np.asarray((x * shape[1] + y) * shape[2] + z)


def _length(vectors: FloatingArray) -> FloatingArray:
    """Return the lengths (...) of vectors (..., 3)."""
    x, y, z = np.moveaxis(vectors, -1, 0)
    return np.asarray(np.sqrt(x * x + y * y + z * z))
