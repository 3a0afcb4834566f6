"""Conversion of numbers between design files and Blender without loss.

Blender stores properties and coordinates in single precision, a design file in double precision.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]


def short(shown: float) -> float:
    """Return the shortest decimal of the same single-precision value: 0.3, not 0.30000001192."""
    return float(str(np.float32(shown)))


def kept(original: Any, shown: float) -> float:
    """Return the number of the design file while Blender still shows it, otherwise Blender's.

    Args:
        original: number of the design file; anything that is no number counts as absent.
        shown: value of the Blender property.
    """
    is_number = isinstance(original, (int, float)) and not isinstance(original, bool)
    if is_number and np.float32(original) == np.float32(shown):
        return original
    return short(shown)


def kept_list(original: Any, shown: Sequence[float]) -> list[float]:
    """Apply `kept` to each number of a vector or colour."""
    if not isinstance(original, (list, tuple)) or len(original) != len(shown):
        original = [None] * len(shown)
    return [kept(one, other) for one, other in zip(original, shown, strict=True)]


def kept_array(original: ArrayLike | None, shown: ArrayLike) -> FloatArray:
    """Apply `kept` to each number of an array; an original of another shape counts as absent."""
    seen = np.asarray(shown, dtype=np.float32)
    short_ones = seen.astype(np.float64)
    if original is not None:
        before = np.asarray(original, dtype=np.float64)
        if before.shape == seen.shape:
            same = before.astype(np.float32) == seen
            if same.all():
                return before
            return np.where(same, before, _short_array(seen))
    return _short_array(seen) if seen.size else short_ones


def _short_array(shown: NDArray[np.float32]) -> FloatArray:
    return np.array([float(str(x)) for x in shown.ravel()]).reshape(shown.shape)


def split(values: ArrayLike) -> list[NDArray[np.float32]]:
    """Split double-precision numbers into three single-precision arrays whose sum is exact.

    Three mantissas of 24 bits hold the 53 bits of a double.
    """
    rest = np.asarray(values, dtype=np.float64)
    parts = []
    for _ in range(3):
        part = rest.astype(np.float32)
        parts.append(part)
        rest = rest - part.astype(np.float64)
    return parts


def joined(parts: Sequence[NDArray[np.float32]]) -> FloatArray:
    """Return the sum of the arrays of `split`, added from the smallest so that no bit is lost."""
    total = np.zeros(parts[0].shape)
    for part in reversed(parts):
        total = part.astype(np.float64) + total
    return total


def shown_number(value: float) -> str:
    """Return a number as text for people: integers in full, others with four significant digits."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int):
        return f"{value:,}"
    text = f"{value:.4g}"
    return f"{text}.0" if text.lstrip("-").isdigit() else text  # a share of 1.0 is no count


def duration(seconds: float) -> str:
    """Return an approximate duration in words."""
    for unit, name in ((3600.0, "hours"), (60.0, "minutes")):
        if seconds >= 1.5 * unit:
            return f"{seconds / unit:.0f} {name}"
    return f"{max(seconds, 1.0):.0f} seconds"
