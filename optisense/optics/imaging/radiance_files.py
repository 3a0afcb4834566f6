"""Reading of EXR files with radiance, such as `TactileImage.save_radiance` writes."""

from __future__ import annotations

import mitsuba as mi
import numpy as np

from optisense.array_types import FloatingArray
from optisense.optics.backend.variant import threads_for_exr_files


def decode_radiance(data: bytes) -> FloatingArray:
    """Return the radiance (h, w, 3), mW/(mm^2 sr), in the content of an EXR file.

    Raises:
        ValueError: the content is no EXR file, or is cut off or damaged.
    """
    try:
        if not _has_all_blocks(data):
            raise ValueError("the EXR file is cut off")
        stream = mi.MemoryStream()
        stream.write(data)
        stream.seek(0)
        with threads_for_exr_files():
            return np.array(mi.Bitmap(stream))
    except (IndexError, RuntimeError) as error:
        raise ValueError(f"no whole EXR file: {error}") from error


def _has_all_blocks(data: bytes) -> bool:
    """Return whether an EXR file of one part has all blocks of pixels that its table of offsets
    names.

    Mitsuba's reader leaves the pixels of missing blocks as whatever the memory held before, which
    may be the whole picture. The layout is that of "OpenEXR File Layout" (openexr.com): magic
    number and version (8 bytes), attributes (name, type, size, value) ended by a zero byte, the
    offset of each block, and the blocks (line number, size, pixels).
    """
    at = 8
    while data[at] != 0:
        for _ in ("name", "type"):
            at = data.index(b"\0", at) + 1
        at += 4 + int.from_bytes(data[at : at + 4], "little")
    table = at + 1
    first = int.from_bytes(data[table : table + 8], "little")
    offsets = np.frombuffer(data[table:first], "<u8")
    last = int(offsets.max())
    return last + 8 + int.from_bytes(data[last + 4 : last + 8], "little") == len(data)
