"""Stored drafts of sensors, which are shown as soon as such a sensor is opened.

Those of sensors that were open before are kept in the folder that Blender gives the extension for
its own files. Those of the built-in sensors come with the engine.
"""

from __future__ import annotations

import hashlib
import json
import shutil
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from ..core.engine import EngineError
from ..engine import design_transfer, session
from ..engine.preferences import PACKAGE
from .exposure import exposure, shown_size
from .picture import show

MOST = 24
"""Largest number of drafts that are kept. A draft is a file of 0.3 MB."""


def folder() -> Path | None:
    """Return the folder of the drafts; None if the extension is not installed and has none."""
    try:
        return Path(bpy.utils.extension_path_user(PACKAGE, path="drafts"))
    except ValueError:
        return None


def shown_by(
    scene: bpy.types.Scene, design: dict[str, Any], contacts: list[dict[str, Any]]
) -> list[Any] | None:
    """Return all that a draft depends on, the engine's version included; None with contacts.

    Args:
        design, contacts: fields of a request for a draft, in which the scene is as now.

    Raises:
        EngineError: there is no engine.
    """
    if contacts:
        return None
    return [session.engine().version, exposure(scene), *design_transfer.contents(design)]


def keep(what: list[Any] | None, result: dict[str, Any]) -> None:
    """Store the draft in the engine's answer; one with contacts or that can't be written is not
    stored.

    Args:
        what: all that the draft depends on, from `shown_by` when it was requested.
    """
    try:
        file = _file(what)
        if file is None:
            return
        file.parent.mkdir(parents=True, exist_ok=True)
        part = file.with_suffix(".part")
        shutil.copyfile(result["files"]["pixels"], part)
        part.replace(file)
        newest = sorted(file.parent.glob("*.npy"), key=lambda each: each.stat().st_mtime)
        for old in newest[:-MOST]:
            old.unlink()
    except OSError:
        return


def show_kept(scene: bpy.types.Scene) -> bool:
    """Show the stored draft of the scene's sensor; return whether there is one."""
    try:
        design, contacts = design_transfer.design(scene), design_transfer.contacts(scene)
        return _show(scene, _file(shown_by(scene, design, contacts)))
    except EngineError:
        return False


def show_built_in(scene: bpy.types.Scene, file: str | None) -> bool:
    """Show the draft of the built-in sensor that the scene has just got; return whether there is
    one for the scene's exposure.

    Args:
        scene: the scene, without contacts.
        file: file of the draft, from the engine; None for other sensors.
    """
    return exposure(scene) == "auto" and _show(scene, None if file is None else Path(file))


def _show(scene: bpy.types.Scene, file: Path | None) -> bool:
    """Show the draft in a file; return whether there is one."""
    try:
        pixels = None if file is None else np.load(file)
    except (OSError, ValueError):  # there is none, or it is damaged
        pixels = None
    if pixels is None or pixels.ndim != 3 or pixels.shape[2] != 4:
        return False
    show(pixels, shown_size(scene))
    now = bpy.context.window_manager.optisense_picture
    now.scene = scene.session_uid
    now.shown = now.is_draft = now.is_stored = True
    now.is_relit = now.is_before = False
    now.image = now.file = now.presses = ""  # the engine does not know it
    now.summary = f"{pixels.shape[1]} x {pixels.shape[0]}"
    session.redraw()
    return True


def _file(what: list[Any] | None) -> Path | None:
    """Return the file of a draft, whose name is a digest of all that it depends on; None if it is
    not stored.
    """
    place = folder()
    if place is None or what is None:
        return None
    text = json.dumps(what, sort_keys=True).encode()
    return place / f"{hashlib.blake2b(text, digest_size=16).hexdigest()}.npy"
