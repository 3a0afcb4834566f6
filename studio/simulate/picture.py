"""The simulated picture in the panel and in Image Editors."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import bpy
import bpy.utils.previews
import numpy as np
from numpy.typing import NDArray

from ..core.viewing import resized

IMAGE = "OptiSense picture"

PAUSE = 0.5
"""Time (s) from a change of an image to its packing, which takes 8 ms, for drafts not to wait."""

_unpacked: set[str] = set()
"""Names of images that changed since they were packed."""

_previews: bpy.utils.previews.ImagePreviewCollection | None = None


when_resized: list[Callable[[str], None]] = []
"""Callbacks with the name of an image that is new or has changed its size."""

when_shown: list[Callable[[NDArray[np.float32]], None]] = []
"""Callbacks with the pixels (h, w, 4) of every picture that is shown."""


def show(pixels: NDArray[np.float32], size: tuple[int, int] | None = None) -> bpy.types.Image:
    """Show a picture in place of the one before.

    Args:
        pixels: picture, (h, w, 4), 0 to 1, row 0 at the bottom.
        size: width and height of the image in Image Editors; a smaller picture is enlarged, so that
            a draft covers the same area as a full picture. None keeps the picture's own size.
    """
    if size is not None:
        pixels = enlarged(pixels, size)
    image = fill(IMAGE, pixels)
    show_icon(IMAGE, pixels)
    for each in when_shown:
        each(pixels)
    return image


def fill(name: str, pixels: NDArray[np.float32]) -> bpy.types.Image:
    """Set the pixels (h, w, 4) of an image, creating it if needed."""
    height, width = pixels.shape[:2]
    image = bpy.data.images.get(name)
    if image is None:
        image = bpy.data.images.new(name, width, height)
        for each in when_resized:
            each(name)
    elif tuple(image.size) != (width, height):
        image.scale(width, height)
        for each in when_resized:
            each(name)
    flat = np.ascontiguousarray(pixels, dtype=np.float32).ravel()
    image.pixels.foreach_set(flat)
    image.update()
    _unpacked.add(name)
    if not bpy.app.background and not bpy.app.timers.is_registered(pack):
        bpy.app.timers.register(pack, first_interval=PAUSE)
    return image


def pack() -> None:
    """Pack the images that changed into the .blend file. Otherwise they count as modified, and
    Blender 5.2 asks whether to save them whenever the file is saved.
    """
    while _unpacked:
        image = bpy.data.images.get(_unpacked.pop())
        if image is not None and image.is_dirty:
            image.pack()


def enlarged(pixels: NDArray[np.float32], size: tuple[int, int]) -> NDArray[np.float32]:
    """Enlarge a picture to a width and height by repeating pixels, (height, width, 4).

    A picture that is as wide or as high already is returned unchanged.
    """
    height, width = pixels.shape[:2]
    if width >= size[0] or height >= size[1]:
        return pixels
    return resized(pixels, *size)


def kind(now: bpy.types.PropertyGroup) -> str:
    """Return the beginning of the line about the picture, if it is not a full one."""
    if now.is_stored:
        return "Stored draft, "
    return "Draft, " if now.is_draft else "Relit, " if now.is_relit else ""


def show_icon(name: str, pixels: NDArray[np.float32]) -> None:
    """Make a picture (h, w, 4), row 0 at the bottom, available to panels under a name."""
    if _previews is None:
        return
    height, width = pixels.shape[:2]
    preview = _previews.get(name) or _previews.new(name)
    preview.image_size = (width, height)
    preview.image_pixels_float.foreach_set(np.ascontiguousarray(pixels, np.float32).ravel())


def icon(name: str = IMAGE) -> int:
    """Return the icon of a picture of `show_icon`; 0 if there is none, or no window."""
    preview = None if _previews is None else _previews.get(name)
    return 0 if preview is None else preview.icon_id


def file_icon(path: str) -> int:
    """Return the icon of a picture file, such as a figure; 0 if the file does not exist."""
    if _previews is None or not path or not Path(path).is_file():
        return 0
    key = f"{path}:{Path(path).stat().st_mtime_ns}"
    preview = _previews.get(key) or _previews.load(key, path, "IMAGE")
    return preview.icon_id


def register() -> None:
    global _previews
    _previews = bpy.utils.previews.new()


def unregister() -> None:
    global _previews
    _unpacked.clear()
    if bpy.app.timers.is_registered(pack):
        bpy.app.timers.unregister(pack)
    if _previews is not None:
        bpy.utils.previews.remove(_previews)
    _previews = None
