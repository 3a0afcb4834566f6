"""Derivatives of layers by the camera's field of view and place.

A camera that moves sees the same light on other places of the skin. So the derivative follows from
the chief rays of two cameras and from the rendered layers alone. A difference quotient of two
renderings would contain their noise: a step of a few per cent changes a smooth background less than
the noise of the light does. At the outline of the skin, such as the edge of a small mirror, the
share of a pixel that sees skin changes.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter, map_coordinates

from optisense.array_types import FloatArray
from optisense.calibration._covered_view import CoveredView, outline_of
from optisense.calibration.model_pictures import LayeredPictures
from optisense.calibration.seen_contacts import SeenContact

if TYPE_CHECKING:
    from collections.abc import Sequence

    from optisense.optics import ChiefRays

FARTHEST = 0.1
"""Largest displacement of a point in the picture, as a share of the picture's width; pixels with a
larger one see another part of the skin, such as by another mirror.
"""

VIEW_BLUR = 3.0
"""Standard deviation, pixels, of the blur of layers before they are displaced: it removes the noise
of single pixels, which moves a fitted view, and spots of light are several times as wide."""


def view_changes(
    layers: LayeredPictures,
    seen: Sequence[SeenContact],
    before: CoveredView,
    after: CoveredView,
) -> list[NDArray[np.float32]]:
    """Return the changes (groups, h, w, 3) of the layers of the background and of each press by a
    change of the view, at the size of the layers.

    Contacts stay where the photographs show them. A contact of the same radius in pixels covers
    more of the skin if a pixel does, and the tilts of a ball's surface grow in proportion: so does
    the response.
    """
    columns, rows = displacements(before.rays, after.rays)
    outline = outline_of(before.coverage, after.coverage)
    skin = layers.background if outline is None else outline.continued(layers.background)
    ground = _change_by(skin, columns, rows)
    if outline is not None:
        more = (after.coverage - before.coverage)[outline.where, None].astype(np.float32)
        ground[:, outline.outside] = 0.0
        ground[:, outline.where] = more * outline.contrast(layers.background)
    scales = [_pixel_sizes(view.rays) for view in (before, after)]
    found = [ground]
    for picture, place in zip(layers.pictures[1:], seen, strict=True):
        row, column = int(place.centre[1]), int(place.centre[0])
        one, other = (float(scale[row, column]) for scale in scales)
        growth = other / one - 1.0 if np.isfinite(one + other) and one > 0.0 else 0.0
        found.append(ground + np.float32(growth) * (picture - layers.background))
    return found


def with_view(
    layers: LayeredPictures,
    seen: Sequence[SeenContact],
    before: CoveredView,
    after: CoveredView,
) -> LayeredPictures:
    """Return layers after a change of the view, see `view_changes`."""
    moved = layers.plus(view_changes(layers, seen, before, after))
    return replace(moved, coverage=None if layers.coverage is None else after.coverage)


def displacements(before: ChiefRays, after: ChiefRays) -> tuple[FloatArray, FloatArray]:
    """Return where the skin that each pixel sees after a change was seen before it: columns and
    rows (h, w) from that pixel, in pixels. They are 0 where either camera sees no skin.
    """
    points = np.where(before.hit[..., None], before.points, np.nan).astype(np.float64)
    down, across = np.gradient(points, axis=(0, 1))
    off = after.points.astype(np.float64) - points
    aa, bb, ab = (
        (one * other).sum(axis=-1)
        for one, other in ((across, across), (down, down), (across, down))
    )
    a, b = (across * off).sum(axis=-1), (down * off).sum(axis=-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        area = aa * bb - ab * ab
        columns, rows = (bb * a - ab * b) / area, (aa * b - ab * a) / area
    limit = FARTHEST * before.hit.shape[1]
    valid = after.hit & (np.hypot(columns, rows) < limit)  # false where either is NaN
    return np.where(valid, columns, 0.0), np.where(valid, rows, 0.0)


def _change_by(
    layers: NDArray[np.float32], columns: FloatArray, rows: FloatArray
) -> NDArray[np.float32]:
    """Return the change of layers (groups, h, w, 3) whose pixels become those at other places of
    the picture.

    Smooth layers are displaced, and the noise stays where it is: an interpolation between pixels
    would average it, and a fit would choose a wrong view because its pictures have less noise.
    Beyond its border, a picture continues linearly.
    """
    height, width = columns.shape
    farthest = max(float(np.abs(columns).max()), float(np.abs(rows).max()))
    pad = min(math.ceil(farthest) + 1, height - 1, width - 1)
    places = np.mgrid[:height, :width] + pad + np.stack([rows, columns])
    found = np.empty_like(layers)
    for index, layer in enumerate(layers):
        for channel in range(layer.shape[-1]):
            smooth = gaussian_filter(layer[..., channel], VIEW_BLUR, mode="mirror")
            wide = np.pad(smooth, pad, mode="reflect", reflect_type="odd")
            found[index, ..., channel] = map_coordinates(wide, places, order=1) - smooth
    return found


def _pixel_sizes(rays: ChiefRays) -> FloatArray:
    """Return the side (h, w) of the square of skin that a pixel sees, mm; NaN where none."""
    points = np.where(rays.hit[..., None], rays.points, np.nan).astype(np.float64)
    down, across = np.gradient(points, axis=(0, 1))
    return np.asarray(np.sqrt(np.linalg.norm(np.cross(across, down), axis=-1)))
