"""Reading and writing of PNG and JPEG files as arrays of bytes."""

from __future__ import annotations

import io
import warnings
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageOps, UnidentifiedImageError

from optisense.errors import OptiSenseError
from optisense.untrusted_files import COPY_AGAIN, MOST_PICTURE, read_bytes


def read_picture(path: Path, error: type[OptiSenseError]) -> NDArray[np.uint8]:
    """Read a picture file as an array (h, w, 3), uint8.

    Args:
        path: path of a PNG or JPEG file.
        error: class of the error that is raised.

    Raises:
        error: the file can't be read.
    """
    return decode_picture(read_bytes(path, MOST_PICTURE, error, "the picture"), path, error)


def decode_picture(data: bytes, path: Path, error: type[OptiSenseError]) -> NDArray[np.uint8]:
    """Decode the content of a PNG or JPEG file to an array (h, w, 3), uint8.

    A picture that is stored turned or mirrored, as its EXIF data say, is turned upright; damaged
    EXIF data are ignored. Of 16-bit channels, the upper byte is kept.

    Raises:
        error: the content is no such file; the message names the path.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # about EXIF data
            warnings.simplefilter("error", Image.DecompressionBombWarning)
            with Image.open(io.BytesIO(data), formats=("PNG", "JPEG")) as picture:
                return _levels(ImageOps.exif_transpose(picture))
    except UnidentifiedImageError:
        raise error(
            "can't read the picture: its content is neither a PNG nor a JPEG file",
            where=str(path),
            hint=COPY_AGAIN,
        ) from None
    except Exception as found:  # Pillow raises many kinds on malformed files
        raise error(
            f"can't read the picture: the file is cut off or damaged ({found})",
            where=str(path),
            hint=COPY_AGAIN,
        ) from None


def _levels(picture: Image.Image) -> NDArray[np.uint8]:
    """Return the levels (h, w, 3) of a picture.

    Pillow keeps the upper byte of 16-bit colours, but clips 16-bit grey at 255.
    """
    if picture.mode.startswith("I"):
        picture = Image.fromarray((np.asarray(picture) >> 8).astype(np.uint8))
    return np.asarray(picture.convert("RGB"), dtype=np.uint8)


def png(picture: NDArray[np.uint8]) -> bytes:
    """Return an array (h, w, 3) or (h, w), uint8, as the content of a PNG file."""
    content = io.BytesIO()
    Image.fromarray(picture).save(content, format="PNG")
    return content.getvalue()


def write_picture(path: Path, picture: NDArray[np.uint8]) -> None:
    """Write an array (h, w, 3), uint8, as a PNG file."""
    path.write_bytes(png(picture))
