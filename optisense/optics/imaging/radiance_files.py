"""Reading of EXR files with radiance, such as `TactileImage.save_radiance` writes."""

from __future__ import annotations

import mitsuba as mi
import numpy as np

from optisense.array_types import FloatingArray
from optisense.optics.backend.variant import threads_for_exr_files


def decode_radiance(data: bytes, resolution: tuple[int, int] | None = None) -> FloatingArray:
    """Return the radiance (h, w, 3), mW/(mm^2 sr), in the content of an EXR file.

    Changed pixels of a file that is readable are not found, as EXR files have no checksum.

    Args:
        resolution: width and height in pixels that the picture must have; any if None. A file of
            another size is refused before memory is allocated for its pixels.

    Raises:
        ValueError: the content is no EXR file, is cut off or unreadable, has another size, or holds
            values that are not finite.
    """
    try:
        window, table = _header(data)
        size = window[2] - window[0] + 1, window[3] - window[1] + 1
        if resolution is not None and size != tuple(resolution):
            raise ValueError(f"its size is {size[0]}x{size[1]} pixels")
        if not _has_all_blocks(data, table):
            raise ValueError("the EXR file is cut off")
        stream = mi.MemoryStream()
        stream.write(data)
        stream.seek(0)
        with threads_for_exr_files():
            radiance = np.array(mi.Bitmap(stream))
    except (IndexError, KeyError, MemoryError, RuntimeError) as error:
        raise ValueError(f"no whole EXR file: {error}") from error
    if not np.isfinite(radiance).all():
        raise ValueError("its values are not all finite")
    return radiance


def _header(data: bytes) -> tuple[list[int], int]:
    """Return the window of an EXR file's pixels (first column and row, last column and row), and
    the place of its table of offsets.

    The layout is that of "OpenEXR File Layout" (openexr.com): magic number and version (8 bytes),
    attributes (name, type, size, value) ended by a zero byte, the offset of each block, and the
    blocks (line number, size, pixels).
    """
    at, values = 8, {}
    while data[at] != 0:
        name_end = data.index(b"\0", at)
        start = data.index(b"\0", name_end + 1) + 5
        size = int.from_bytes(data[start - 4 : start], "little")
        values[data[at:name_end]] = data[start : start + size]
        at = start + size
    return np.frombuffer(values[b"dataWindow"], "<i4", 4).tolist(), at + 1


def _has_all_blocks(data: bytes, table: int) -> bool:
    """Return whether an EXR file of one part has all blocks of pixels that its table of offsets
    names.

    Mitsuba's reader leaves the pixels of missing blocks as whatever the memory held before, which
    may be the whole picture.
    """
    first = int.from_bytes(data[table : table + 8], "little")
    offsets = np.frombuffer(data[table:first], "<u8")
    last = int(offsets.max())
    return last + 8 + int.from_bytes(data[last + 4 : last + 8], "little") == len(data)
