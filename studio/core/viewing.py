"""Display of a picture: a channel, false colours, or a comparison with another picture."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

CHANNELS = {"COLOUR": None, "RED": 0, "GREEN": 1, "BLUE": 2, "MEAN": None}
"""Index of each channel in a picture; None means all of them, which `MEAN` averages."""

HEAT = (
    (0.00, 0.02, 0.02, 0.12),
    (0.25, 0.30, 0.08, 0.50),
    (0.50, 0.80, 0.22, 0.30),
    (0.75, 0.98, 0.62, 0.12),
    (1.00, 1.00, 0.98, 0.80),
)
"""Colour map for brightness, rows of value, red, green, blue in 0..1; lightness only grows."""

DIVERGING = (
    (0.00, 0.10, 0.30, 0.85),
    (0.50, 0.90, 0.90, 0.90),
    (1.00, 0.85, 0.15, 0.10),
)
"""Colour map for differences, rows of value, red, green, blue in 0..1: blue is darker than before,
red is brighter.
"""

SEAM = 0.002
"""Half the width of the line between two pictures, as a share of the picture's width."""


def viewed(
    now: NDArray[np.float32],
    pinned: NDArray[np.float32] | None = None,
    *,
    channel: str = "COLOUR",
    false_colour: bool = False,
    compare: str = "NONE",
    wipe: float = 0.5,
    gain: float = 4.0,
) -> NDArray[np.float32]:
    """Return a picture as the viewer shows it.

    Args:
        now: picture, (h, w, 4), 0 to 1.
        pinned: picture to compare with, (H, W, 4), or None.
        channel: key of `CHANNELS`.
        false_colour: show brightness as colours, so that small differences are visible.
        compare: `WIPE` shows the pinned picture left of `wipe`, `DIFFERENCE` shows the difference,
            grey where both are alike, `NONE` shows the picture alone.
        wipe: position of the line between both pictures, 0 to 1 of the width.
        gain: factor on the differences; with 1 the full range goes from black to white.

    Returns:
        (h, w, 4) float32, opaque.
    """
    shown = _one_channel(now, channel)
    other = None
    if pinned is not None and compare != "NONE":
        other = _one_channel(resized(pinned, now.shape[1], now.shape[0]), channel)
    if other is not None and compare == "DIFFERENCE":
        values = 0.5 + 0.5 * gain * (shown - other)
        found = coloured(values.mean(axis=2), DIVERGING) if false_colour else values
        return _opaque(found)
    found = coloured(shown.mean(axis=2), HEAT) if false_colour else shown
    if other is not None:
        before = coloured(other.mean(axis=2), HEAT) if false_colour else other
        across = (np.arange(now.shape[1]) + 0.5) / now.shape[1]
        found = np.where((across < wipe)[None, :, None], before, found)
        found[:, abs(across - wipe) <= SEAM] = 1.0
    return _opaque(found)


def resized(picture: NDArray[np.float32], width: int, height: int) -> NDArray[np.float32]:
    """Return a picture at another size by nearest neighbours, (height, width, channels)."""
    rows = np.arange(height) * picture.shape[0] // height
    columns = np.arange(width) * picture.shape[1] // width
    # faster than indexing with both
    return np.take(np.take(picture, columns, axis=1), rows, axis=0)


def coloured(
    values: NDArray[np.float32], stops: tuple[tuple[float, float, float, float], ...]
) -> NDArray[np.float32]:
    """Map values (h, w) to colours (h, w, 3) by linear interpolation between `stops`; values beyond
    the ends get the end colours.
    """
    table = np.array(stops)
    return np.stack(
        [np.interp(values, table[:, 0], table[:, each]) for each in (1, 2, 3)], axis=-1
    ).astype(np.float32)


def _one_channel(picture: NDArray[np.float32], channel: str) -> NDArray[np.float32]:
    """Return the colours, or one channel as grey, (h, w, 3)."""
    colour = picture[..., :3]
    if channel == "COLOUR":
        return colour
    column = CHANNELS[channel]
    grey = colour.mean(axis=2) if column is None else colour[..., column]
    return np.repeat(grey[..., None], 3, axis=2)


def _opaque(colour: NDArray[np.float32]) -> NDArray[np.float32]:
    height, width = colour.shape[:2]
    found = np.ones((height, width, 4), dtype=np.float32)
    found[..., :3] = np.clip(colour, 0.0, 1.0)
    return found
