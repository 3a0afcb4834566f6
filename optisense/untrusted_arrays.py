"""Reader of NumPy arrays in files from untrusted sources."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from optisense.errors import OptiSenseError
from optisense.text import brief
from optisense.untrusted_files import (
    COPY_AGAIN,
    MEBIBYTE,
    Error,
    damaged,
    read_bytes,
    refuse_size,
)

MOST_ARRAYS = 2048 * MEBIBYTE
"""Largest size of the arrays of one file, unpacked, bytes: depth, normals and mask of a picture of
100 million pixels have 1.7 GB.
"""

ARRAYS = "the arrays"
"""Word for the content of an NPZ file in messages."""


def read_arrays(path: Path, error: Error, most: int = MOST_ARRAYS) -> dict[str, NDArray[Any]]:
    """Return the arrays of an NPZ file by name; pickled objects in it are refused.

    Args:
        error: class of the error that is raised.
        most: largest size of all arrays together, unpacked, bytes.

    Raises:
        error: the file is missing, truncated, damaged, or too large once it is unpacked.
    """
    data = read_bytes(path, most, error, ARRAYS)
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            unpacked = sum(member.file_size for member in archive.infolist())
        refuse_size(unpacked, most, path, error, ARRAYS)
        with np.load(io.BytesIO(data), allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
        for name, array in arrays.items():
            if not isinstance(array, np.ndarray):  # NumPy returns other members as bytes
                raise ValueError(f"'{brief(name)}' is no array")
        return arrays
    except OptiSenseError:
        raise
    except Exception as found:  # zipfile, zlib and NumPy raise many kinds on malformed files
        raise damaged(path, error, ARRAYS, found) from None


def read_array(path: Path, error: Error) -> NDArray[Any]:
    """Return the array of an NPY file; pickled objects in it are refused.

    Raises:
        error: the file is missing, truncated or damaged.
    """
    data = read_bytes(path, MOST_ARRAYS, error, "the array")
    try:
        return np.lib.format.read_array(io.BytesIO(data), allow_pickle=False)
    except Exception as found:  # NumPy raises many kinds on malformed files
        raise damaged(path, error, "the array", found) from None


def check_arrays(
    arrays: Mapping[str, NDArray[Any]],
    kinds: Mapping[str, tuple[str, int | None]],
    size: tuple[int, int],
    path: Path,
    error: Error,
) -> None:
    """Check that all arrays of a picture exist, and have the right type and size.

    Args:
        kinds: required arrays by name: the allowed types, as NumPy's `dtype.kind`, and the number
            of channels (None for an array without a channel axis).
        size: height and width.
        path: path of their file, for messages.
        error: class of the error that is raised.

    Raises:
        error: an array is missing, or of another type or shape.
    """
    for name, (types, channels) in kinds.items():
        if name not in arrays:
            raise error(f"the array '{name}' is missing", where=str(path), hint=COPY_AGAIN)
        array = arrays[name]
        wanted = (*size, *(() if channels is None else (channels,)))
        if array.dtype.kind not in types or array.shape != wanted:
            raise error(
                f"the array '{name}' is of {array.dtype} and has the shape {array.shape}, not "
                f"{wanted}",
                where=str(path),
                hint=COPY_AGAIN,
            )
