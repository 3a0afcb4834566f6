"""Arrays as PNG pictures inside a page, and the colours of what they show."""

from __future__ import annotations

import base64

import numpy as np
from numpy.typing import NDArray

from optisense.array_types import ByteArray, FloatingArray
from optisense.picture_files import png

MOST_STRETCHED = 4.0
"""Stretching at the end of the colour scale: a ball four times as long as wide hardly looks like a
ball, and finer differences beyond that matter little.
"""


def data_uri(picture: ByteArray) -> str:
    """Return a picture (h, w, 3) as the address of an ``<img>`` that contains its data as PNG."""
    return "data:image/png;base64," + base64.b64encode(png(picture)).decode("ascii")


def normal_colours(normals: FloatingArray, axes: NDArray[np.float64]) -> ByteArray:
    """Return surface normals as the usual normal-map colours, seen by the camera.

    Args:
        normals: unit normals (h, w, 3) in the design's frame; zero or NaN where there is none.
        axes: rows (3, 3): image right, image up, viewing direction, in the design's frame.

    Returns:
        Colours (h, w, 3), uint8: red = image right, green = image up, blue = towards the camera;
        black where there is no surface.
    """
    valid = np.isfinite(normals).all(axis=-1) & (np.linalg.norm(normals, axis=-1) > 0.5)
    seen = np.nan_to_num(normals) @ (axes * np.array([[1.0], [1.0], [-1.0]])).T
    # A normal may be given for either side of the surface: show the one towards the camera.
    seen = np.where(seen[..., 2:] < 0, -seen, seen)
    colours = np.round((0.5 + 0.5 * np.clip(seen, -1, 1)) * 255).astype(np.uint8)
    colours[~valid] = 0
    return colours


def stretching_colours(stretching: FloatingArray) -> ByteArray:
    """Return a map of the stretching of pixels: dark blue is undistorted, yellow `MOST_STRETCHED`
    or more.

    Args:
        stretching: stretching (h, w), 1 or more; NaN, drawn black, where nothing is seen.

    Returns:
        Colours (h, w, 3), uint8.
    """
    from matplotlib import colormaps

    share = np.clip((np.nan_to_num(stretching, nan=1.0) - 1.0) / (MOST_STRETCHED - 1.0), 0.0, 1.0)
    colours: ByteArray = np.round(255 * colormaps["viridis"](share)[..., :3]).astype(np.uint8)
    colours[~np.isfinite(stretching)] = 0
    return colours


def pressure_colours(pressure: FloatingArray) -> ByteArray:
    """Return a map of pressure from black (none) by red and yellow to white (the greatest).

    Args:
        pressure: pressure (h, w), 0 or more; NaN, drawn black, where nothing is seen.

    Returns:
        Colours (h, w, 3), uint8.
    """
    known = np.nan_to_num(pressure)
    share = known / max(float(known.max()), np.finfo(np.float64).tiny)
    ramp = np.clip(3.0 * share[..., None] - np.arange(3.0), 0.0, 1.0)
    return np.round(255 * ramp).astype(np.uint8)


def mask_overlay(picture: ByteArray, mask: NDArray[np.bool_]) -> ByteArray:
    """Return a picture (h, w, 3), grey but for a mask (h, w), with a white outline."""
    from scipy.ndimage import binary_erosion

    grey = (picture.astype(np.float64) @ [0.299, 0.587, 0.114] * 0.45)[..., None]
    shown = np.where(mask[..., None], picture, grey.astype(np.uint8))
    shown[mask & ~binary_erosion(mask)] = 255
    return shown.astype(np.uint8)
