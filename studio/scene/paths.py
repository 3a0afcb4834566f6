"""Files and folders as users name them."""

from __future__ import annotations

import re
from pathlib import Path

import bpy

LONGEST = 100
"""Characters of a file's name that is made of a sensor's."""


def absolute(text: str) -> Path:
    """The path that a text names, which may be relative to the .blend file, with `//` or without.

    While there is no .blend file yet it is relative to the user's own folder, not to whichever one
    Blender was started in.
    """
    blend = bpy.data.filepath
    base = Path(blend).parent if blend else Path.home()
    return (base / Path(text.strip().removeprefix("//")).expanduser()).resolve()


def chosen(operator: bpy.types.Operator, what: str) -> Path | None:
    """The path that a file selector gave an operator; where it gave none, the user is told so.

    Args:
        operator: has a `filepath`.
        what: a file or a folder, in words.
    """
    if not operator.filepath.strip():
        operator.report({"ERROR"}, f"Name {what} first")
        return None
    return absolute(operator.filepath)


def suggested(scene: bpy.types.Scene, end: str = "") -> str:
    """A path for a file or folder that is named after a scene's sensor."""
    name = re.sub(r'[\\/:*?"<>|\x00-\x1f]+', "-", scene.optisense.title).strip(" .-")[:LONGEST]
    return str(Path.home() / f"{name or 'sensor'}{end}")


def objective(text: str) -> str:
    """An objective as the engine names it; of `FILE.py:FUNCTION` with the whole path."""
    return str(absolute(text)) if ".py" in text else text.strip()
