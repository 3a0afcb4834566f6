"""Comparison of files: pictures up to rounding errors, all others byte by byte.

The same seed gives the same picture up to rounding, as threads add up light in any order.
"""

from __future__ import annotations

import io
from pathlib import PurePath
from typing import Any

import numpy as np
import pyarrow.parquet as pq
from PIL import Image

from optisense.optics.imaging.radiance_files import decode_radiance

TOLERANCE = 1e-3
"""Mean difference of two arrays, of the largest value, that rounding makes at most. Rays that it
sends another way change some pixels; pictures of two seeds differ a hundred times more."""


FIT_TOLERANCE = 3e-4
"""Share of a number, or of `SMALL_NUMBER` where that is more, by which two fits of the same
pictures differ at most: a fit stops before it is exact, so rounding of the pictures moves its end.
Fits that were killed and made again were seen to differ by 9e-5 in small elements of a colour
matrix, and by 2e-6 in fluxes."""

SMALL_NUMBER = 0.01
"""The size of number below which differences count absolutely; fluxes and colours are about 1."""


def same_values(one: Any, other: Any) -> bool:
    """Whether plain data are the same, numbers within `FIT_TOLERANCE`."""
    if isinstance(one, dict) and isinstance(other, dict):
        return one.keys() == other.keys() and all(same_values(one[k], other[k]) for k in one)
    if isinstance(one, list | tuple) and isinstance(other, list | tuple):
        pairs = zip(one, other, strict=False)
        return len(one) == len(other) and all(same_values(a, b) for a, b in pairs)
    if isinstance(one, float) and isinstance(other, float):
        return abs(one - other) <= FIT_TOLERANCE * max(abs(one), abs(other), SMALL_NUMBER)
    return bool(one == other)


def agrees(name: str, one: bytes | None, other: bytes | None) -> bool:
    """Whether the contents of a file of this name are the same in two results."""
    if one == other:
        return True
    if one is None or other is None:
        return False
    try:
        first, second = (_arrays(PurePath(name).suffix, each) for each in (one, other))
    except Exception:  # each of the libraries raises its own for a file that is cut off
        return False
    return (
        bool(first)
        and first.keys() == second.keys()
        and all(_near(first[key], second[key]) for key in first)
    )


def _arrays(suffix: str, data: bytes) -> dict[str, Any]:
    """The arrays in a file by their names; none of a file that holds none."""
    if suffix == ".png":
        return {"": np.asarray(Image.open(io.BytesIO(data)), dtype=float)}
    if suffix == ".npy":
        return {"": np.load(io.BytesIO(data))}
    if suffix == ".npz":
        with np.load(io.BytesIO(data)) as file:
            return dict(file)
    if suffix == ".exr":
        return {"": decode_radiance(data).astype(float)}
    if suffix == ".parquet":
        return {"": pq.read_table(io.BytesIO(data))["index"].to_numpy()}  # its samples
    return {}


def _near(one: Any, other: Any) -> bool:
    if one.shape != other.shape or one.dtype != other.dtype:
        return False
    first, second = one.astype(float), other.astype(float)
    if not np.array_equal(np.isfinite(first), np.isfinite(second)):
        return False
    known = np.isfinite(first)
    off = np.abs(first[known] - second[known])
    return not off.size or bool(off.mean() <= TOLERANCE * np.abs(first[known]).max(initial=0.0))
