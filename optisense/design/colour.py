"""Named colours, colours of parts in drawings, and the sRGB transfer curve (IEC 61966-2-1)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

NAMED_COLOURS = {
    "red": (1.0, 0.0, 0.0),
    "green": (0.0, 1.0, 0.0),
    "blue": (0.0, 0.0, 1.0),
    "white": (1.0, 1.0, 1.0),
}
"""R, G and B of the named colours."""

ROLE_LOOKS: dict[str, tuple[str, float]] = {
    "sensing_surface": ("#8d99a6", 0.55),
    "elastomer": ("#f2a65a", 0.28),
    "support": ("#6fb7e9", 0.24),
    "mirror": ("#cfd8e3", 0.75),
    "blocker": ("#3b3f46", 1.0),
    "interface": ("#b7a6f2", 0.3),
    "indenter": ("#b9a44c", 1.0),
}
"""Colour and opacity (0 to 1) of each role: transparent parts show what is behind them."""

WAVELENGTHS = 200.0, 2000.0
"""Range of dominant wavelengths of lights, nm: from the shortest of LEDs to beyond what sensors of
silicon see. A value outside is an error of the unit, such as 0.625 for 625 nm."""


def srgb_curve(linear: NDArray[np.floating]) -> NDArray[np.float64]:
    """Return the sRGB encoding (...), 0 to 1 before rounding, of linear values (...), 0 to 1."""
    linear = np.clip(np.asarray(linear, dtype=float), 0.0, 1.0)
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


def encode(linear: NDArray[np.floating]) -> NDArray[np.uint8]:
    """Return the sRGB encoding (...) in 8 bits of linear values (...), 0 to 1.

    The computation is in single precision for speed.
    """
    linear = np.clip(np.asarray(linear, dtype=np.float32), 0.0, 1.0)
    curved = np.power(linear, np.float32(1 / 2.4))
    curved *= np.float32(255 * 1.055)
    curved += np.float32(0.5 - 255 * 0.055)  # the conversion truncates, so this rounds
    dark = linear <= 0.0031308
    curved[dark] = linear[dark] * np.float32(255 * 12.92) + np.float32(0.5)
    return curved.astype(np.uint8)


def decode(picture: NDArray[np.uint8]) -> NDArray[np.float64]:
    """Return the linear values (...), 0 to 1, of an sRGB picture (...) in 8 bits."""
    encoded = picture.astype(np.float64) / 255.0
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
