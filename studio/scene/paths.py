"""Files and folders as users name them."""

from __future__ import annotations

import re
from pathlib import Path

import bpy

LONGEST = 100
"""Largest number of characters of a file name made of a sensor's name."""


def absolute(text: str) -> Path:
    """Return the path for a text, relative to the .blend file, with `//` or without, or absolute.

    Without a .blend file it is relative to the user's home folder, not to the folder in which
    Blender was started.
    """
    blend = bpy.data.filepath
    base = Path(blend).parent if blend else Path.home()
    return (base / Path(text.strip().removeprefix("//")).expanduser()).resolve()


def chosen(operator: bpy.types.Operator, what: str) -> Path | None:
    """Return the path that an operator's file selector returned; without one, tell the user and
    return None.

    Args:
        operator: operator with a `filepath`.
        what: a file or a folder, in words.
    """
    if not operator.filepath.strip():
        operator.report({"ERROR"}, f"Name {what} first")
        return None
    return absolute(operator.filepath)


def suggested(scene: bpy.types.Scene, end: str = "") -> str:
    """Return a path in the home folder that is named after a scene's sensor."""
    name = re.sub(r'[\\/:*?"<>|\x00-\x1f]+', "-", scene.optisense.title).strip(" .-")[:LONGEST]
    return str(Path.home() / f"{name or 'sensor'}{end}")


def objective(text: str) -> str:
    """Return an objective as the engine names it; the path in `FILE.py:FUNCTION` is absolute."""
    return str(absolute(text)) if ".py" in text else text.strip()
