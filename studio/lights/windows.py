"""Windows of the lamps of light groups, queried from the engine to draw their real size."""

from __future__ import annotations

import json
from typing import Any

import bpy

from ..engine import session
from ..scene import properties
from ..scene.gather import emitter_values
from ..scene.lamps import redraw
from ..scene.subject import scene_of

MOST_KNOWN = 1024
"""Number of lamps that are remembered: a dragged slider asks about one for each of its values."""

_known: dict[str, str] = {}
"""Answers of the engine by the fields of their requests, both as JSON, the newest last."""


def ask_for_windows(scene: bpy.types.Scene) -> None:
    """Query the lamps of all groups of a design, and draw them."""
    for group in scene.optisense.light_groups:
        ask_for_window(scene, group)


def ask_for_window(scene: bpy.types.Scene, group: bpy.types.PropertyGroup) -> None:
    """Query the lamps of a group, and draw them; if the engine refuses, the drawing stays."""
    number, name, asked = scene.session_uid, group.name, _lamp(scene, group)

    def known(result: dict[str, Any]) -> None:
        lamp = json.dumps(asked)
        _known.pop(lamp, None)
        _known[lamp] = json.dumps(result)
        if len(_known) > MOST_KNOWN:
            del _known[next(iter(_known))]
        scene = scene_of(number)
        group = None if scene is None else scene.optisense.light_groups.get(name)
        if group is not None and _lamp(scene, group) == asked:
            _draw(scene, group)

    session.ask("lamp", known, lambda error: None, **asked)


def _draw(scene: bpy.types.Scene, group: bpy.types.PropertyGroup) -> bool:
    """Draw the lamps of a group as the engine's last answer about them says; return whether there
    is one.
    """
    drawn = _known.get(json.dumps(_lamp(scene, group)))
    if drawn is not None and group.drawn != drawn:
        group.drawn = drawn
        redraw(scene, group)
    return drawn is not None


def _lamp(scene: bpy.types.Scene, group: bpy.types.PropertyGroup) -> dict[str, Any]:
    """Return the fields of a request for the lamps of a group."""
    value = emitter_values(group)
    if value is None:
        return {"entry": group.model}
    folder = scene.optisense.folder
    return {"value": value, "folder": folder} if folder else {"value": value}


def _reshaped(scene: bpy.types.Scene, group: bpy.types.PropertyGroup) -> None:
    if session.running() is not None:
        ask_for_window(scene, group)


@bpy.app.handlers.persistent
def _undone(*_: Any) -> None:
    """Draw the lamps again after undo or redo: a step may be older than the engine's answer."""
    for scene in bpy.data.scenes:
        for group in scene.optisense.light_groups:
            if not _draw(scene, group):
                _reshaped(scene, group)


HOOKS = (
    (properties.when_reshaped, _reshaped),
    (bpy.app.handlers.undo_post, _undone),
    (bpy.app.handlers.redo_post, _undone),
)
