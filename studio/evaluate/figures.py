"""Figures of scores as images of Blender."""

from __future__ import annotations

from pathlib import Path

import bpy

PREFIX = "OptiSense figure: "


def load(title: str, file: str) -> bpy.types.Image:
    """Load a figure as an image, in place of an earlier one with the same title.

    The image is packed: the file is the engine's and is deleted with it, whereas the figure stays
    in the user's .blend file if an editor shows it.

    Raises:
        RuntimeError: the file does not exist or is no picture.
    """
    name = f"{PREFIX}{title}"
    loaded = bpy.data.images.load(file)
    before = bpy.data.images.get(name)
    if before is not None:
        before.user_remap(loaded)  # editors that show it show the new one
        bpy.data.images.remove(before)
    loaded.name = name
    loaded.pack()
    return loaded


def is_there(file: str) -> bool:
    """Return whether the engine's file of a figure still exists."""
    return bool(file) and Path(file).is_file()
