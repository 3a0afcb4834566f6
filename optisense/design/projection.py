"""Projection of points into a design's camera, and its pixels' directions, without refraction.

A position in the picture is given by shares of its width and height: 0 to 1 `across` from the left
and `down` from the top, as arrays of one shape (...).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from optisense.array_types import FloatArray
from optisense.design.camera import Camera

FOLD_PLACES = 13
"""Number of positions along the picture's width and its height at which a lens is tested for
folding; the borders and the corners, where lenses fold first, are among them."""

FOLD_STEPS = 24
"""Number of steps from the axis to each of the positions where a lens is tested for folding."""

UNDISTORTED_TO = 1e-9
"""Largest error on the image plane of a position that is undistorted and distorted again; a lens
that folds has a larger one, or no such position."""


def image_edges(camera: Camera) -> tuple[float, float]:
    """Return half the width and height of the picture on the image plane (see `distortion`)."""
    half = np.radians(0.5 * camera.fov)
    edge = float(half if camera.projection == "equidistant" else np.tan(half))
    return edge, edge * camera.resolution[1] / camera.resolution[0]


def shown_places(camera: Camera, across: FloatArray, down: FloatArray) -> FloatArray:
    """Return x and y (2, ...) on the image plane, as the lens shows them, of positions (...)."""
    edge, tall = image_edges(camera)
    middle = (0.5, 0.5) if camera.distortion is None else camera.distortion.centre
    return np.array([2.0 * edge * (across - middle[0]), 2.0 * tall * (down - middle[1])])


def ideal_places(camera: Camera, across: FloatArray, down: FloatArray) -> FloatArray:
    """Return x and y (2, ...) on the image plane of an ideal lens for positions in the picture."""
    shown = shown_places(camera, across, down)
    lens = camera.distortion
    if lens is None:
        return shown
    with np.errstate(all="ignore"):  # a lens that folds has positions without any
        return np.array(lens.undistort(shown[0], shown[1], lens.coefficients()))


def directions(camera: Camera, across: FloatArray, down: FloatArray) -> FloatArray:
    """Return unit vectors (..., 3) in the viewing directions of positions in the picture.

    A fisheye shows nothing at positions that would be more than 180 degrees off its axis; they get
    the direction at 180 degrees.
    """
    x, y = ideal_places(camera, across, down)
    height = np.hypot(x, y)
    angle = np.minimum(height, np.pi) if camera.projection == "equidistant" else np.arctan(height)
    scale = np.sin(angle) / np.maximum(height, 1e-300)
    scale = np.where(height < 1e-12, 1.0, scale)
    return np.stack([x * scale, -y * scale, np.cos(angle)], axis=-1) @ camera.axes()


def within_view(camera: Camera, across: FloatArray, down: FloatArray) -> NDArray[np.bool_]:
    """Return a mask (...) of the positions that show something: a fisheye shows nothing at those
    that would be more than 180 degrees off its axis.
    """
    height = np.hypot(*ideal_places(camera, across, down))
    return np.asarray((height <= np.pi) | (camera.projection != "equidistant"))


def picture_places(camera: Camera, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the positions across (n,) and down (n,) of points (n, 3), mm.

    Positions outside of the picture are below 0 or above 1; those of points that the lens can't
    show are NaN.
    """
    right, up, depth = camera.axes() @ (np.asarray(points) - np.array(camera.position)).T
    aside = np.hypot(right, up)
    angle = np.arctan2(aside, depth)
    if camera.projection == "equidistant":
        height = angle
    else:
        height = np.where(depth > 0.0, np.tan(np.minimum(angle, 1.57)), np.nan)
    scale = height / np.maximum(aside, 1e-300)
    x, y = right * scale, -up * scale
    edge, tall = image_edges(camera)
    lens = camera.distortion
    middle = (0.5, 0.5)
    if lens is not None:
        middle = lens.centre
        # Farther off the axis than any corner of the picture the polynomial is not valid.
        beyond = np.hypot(x, y) > 1.001 * _largest_height(camera)
        with np.errstate(all="ignore"):
            x, y = lens.distort(x, y, lens.coefficients())
        x, y = np.where(beyond, np.nan, x), np.where(beyond, np.nan, y)
    return middle[0] + 0.5 * x / edge, middle[1] + 0.5 * y / tall


def _largest_height(camera: Camera) -> float:
    """Return the largest distance from the axis, on the ideal image plane, in the picture."""
    along = np.linspace(0.0, 1.0, FOLD_PLACES)
    across = np.concatenate([along, along, 0.0 * along, 0.0 * along + 1.0])
    down = np.concatenate([0.0 * along, 0.0 * along + 1.0, along, along])
    return float(np.nanmax(np.hypot(*ideal_places(camera, across, down))))


def angle_across(camera: Camera) -> float:
    """Return the angle that a fisheye sees across the picture, degrees, with its distortion."""
    middle = 0.5 if camera.distortion is None else camera.distortion.centre[1]
    x, _ = ideal_places(camera, np.array([0.0, 1.0]), np.full(2, middle))
    return float(np.degrees(np.abs(x).sum()))


def folding_angle(camera: Camera) -> float | None:
    """Return the angle off the axis, degrees, at which a lens folds within the picture; None for a
    lens that shows each point of the picture once.

    Beyond this angle the distortion has no inverse: two directions are shown at one position, and
    others nowhere. The angles of 16 lenses are kept, as the search takes 2 ms and each check asks.
    """
    if camera.distortion is None:
        return None
    data = camera.model_dump_json(include={"fov", "projection", "resolution", "distortion"})
    return _folding_angle(_Lens(camera, data))


@dataclass(frozen=True)
class _Lens:
    """Camera that is compared by the values that decide where its lens folds."""

    camera: Camera = field(compare=False)
    data: str


@lru_cache(maxsize=16)
def _folding_angle(distorted: _Lens) -> float | None:
    camera = distorted.camera
    lens = camera.distortion
    assert lens is not None
    along = np.linspace(0.0, 1.0, FOLD_PLACES)
    across, down = np.meshgrid(along, along)
    shown = shown_places(camera, across, down)
    ideal = ideal_places(camera, across, down)
    numbers = lens.coefficients()
    with np.errstate(all="ignore"):
        off = np.hypot(*(np.array(lens.distort(ideal[0], ideal[1], numbers)) - shown))
        found = off <= UNDISTORTED_TO * np.maximum(1.0, np.hypot(*shown))
        way = np.linspace(0.0, 1.0, FOLD_STEPS).reshape(-1, 1, 1)
        a, b, c, d = lens.jacobian(way * ideal[0], way * ideal[1], numbers)
        unfolded = (a * d - b * c > 0.0).all(axis=0)
    bad = ~(found & unfolded)
    if not bad.any():
        return None
    farthest = shown[:, bad][:, np.argmax(np.hypot(*shown[:, bad]))]
    way = farthest / np.hypot(*farthest)
    limit = np.pi if camera.projection == "equidistant" else np.tan(np.radians(89.9))
    height = np.geomspace(1e-3, limit, 4000)
    a, b, c, d = lens.jacobian(way[0] * height, way[1] * height, numbers)
    folds = np.flatnonzero(a * d - b * c <= 0.0)
    at = float(height[folds[0]] if len(folds) else limit)
    return float(np.degrees(at if camera.projection == "equidistant" else np.arctan(at)))
