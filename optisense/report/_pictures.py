"""Figures, pictures and arrays as data inside a page, and the colours of what they show."""

from __future__ import annotations

import base64
import io
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from optisense.array_types import ByteArray, FloatingArray
from optisense.design.responses.base import MAX_EXCESS, FullWellResponse
from optisense.design.responses.chain import PictureChain
from optisense.picture_files import png

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

DOTS_PER_INCH = 110
"""Resolution of figures, dots per inch, which makes them as wide as the page's text."""


def legend_above(axes: Axes, columns: int = 2) -> None:
    """Draw a legend above a plot, where it covers nothing of it."""
    axes.legend(
        fontsize=8,
        loc="lower left",
        bbox_to_anchor=(0.0, 1.0),
        ncols=columns,
        frameon=False,
        borderaxespad=0.2,
    )


def figure_uri(figure: Figure) -> str:
    """Return a figure as the address of an ``<img>`` that contains its data."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=DOTS_PER_INCH)
    return _png_uri(buffer.getvalue())


def swatch_of(colour: Sequence[float]) -> str:
    """Return the colour of a light as CSS, scaled to a brightest channel of 255.

    Args:
        colour: colour (3,) of the light, on any scale.
    """
    brightest = max(*colour, 1e-9)
    red, green, blue = (round(255 * value / brightest) for value in colour)
    return f"rgb({red}, {green}, {blue})"


def encoded(values: NDArray[Any], dtype: Any) -> str:
    """Encode an array (any shape) for a page's script: little-endian numbers as base64 text."""
    little_endian = np.ascontiguousarray(values, dtype=np.dtype(dtype).newbyteorder("<"))
    return base64.b64encode(little_endian.tobytes()).decode("ascii")


MOST_STRETCHED = 4.0
"""Stretching at the end of the colour scale: a ball four times as long as wide hardly looks like a
ball, and finer differences beyond that matter little.
"""


def data_uri(picture: ByteArray) -> str:
    """Return a picture (h, w, 3) as the address of an ``<img>`` that contains its data as PNG."""
    return _png_uri(png(picture))


def _png_uri(file: bytes) -> str:
    return "data:image/png;base64," + base64.b64encode(file).decode("ascii")


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


CODES = 4096
"""Number of levels of a layer: 16 for each grey level of a picture, so that twice the sum of eight
layers is correct within one grey level.
"""

CURVE_STEPS = 2048
"""Number of steps of the table of the tone curve over the square root of the linear level;
neighbours differ by at most one grey level for a curve as steep as sRGB's.
"""


def mixing_data(
    layers: Mapping[str, FloatingArray], exposure: float, chain: PictureChain
) -> dict[str, Any]:
    """Return the data with which the page shows a picture for other brightnesses of the light
    groups.

    The levels of a layer are those before overexposure and clipping, which apply to the sum. They
    are stored by their square root, in two pictures of 8 and 4 bits, since browsers read no finer
    ones.

    Args:
        layers: linear radiance (h, w, 3) for each light group.
        exposure: factor on the radiance.

    Returns:
        Values that can be written as JSON.
    """
    response = chain.response
    spread = None
    if isinstance(response, FullWellResponse) and chain.is_plain:
        width = next(iter(layers.values())).shape[1] if layers else 1
        spread = {
            "full": response.full_well, "most": MAX_EXCESS, "pixels": response.blur * width,
        }  # fmt: skip
    return {
        "layers": {name: _coded(chain.linear(exposure * each)) for name, each in layers.items()},
        "curve": _curve(chain),
        "spread": spread,
    }


def _coded(levels: FloatingArray) -> dict[str, Any]:
    roots = np.sign(levels) * np.sqrt(np.abs(levels))
    least, most = min(float(roots.min()), 0.0), max(float(roots.max()), 1e-6)
    step = (most - least) / (CODES - 1)
    codes = np.round((roots - least) / step).astype(np.uint16)
    return {
        "least": least,
        "step": step,
        "coarse": data_uri((codes >> 4).astype(np.uint8)),
        "fine": data_uri((codes & 15).astype(np.uint8)),
    }


def _curve(chain: PictureChain) -> str:
    """Return the grey levels of the squares of 0 to 1, one byte each."""
    levels = np.linspace(0.0, 1.0, CURVE_STEPS + 1, dtype=np.float32) ** 2
    return encoded(chain.encode(levels), np.uint8)
