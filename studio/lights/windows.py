"""Windows of the lamps of light groups, queried from the engine to draw their real size."""

from __future__ import annotations

import json
from typing import Any

import bpy

from ..engine import session
from ..scene import properties
from ..scene.gather import emitter_values
from ..scene.lamps import redraw


def ask_for_windows(scene: bpy.types.Scene) -> None:
    """Query the lamps of all groups of a design, and draw them."""
    for group in scene.optisense.light_groups:
        ask_for_window(scene, group)


def ask_for_window(scene: bpy.types.Scene, group: bpy.types.PropertyGroup) -> None:
    """Query the lamps of a group, and draw them; if the engine refuses, the drawing stays."""
    name, lamps = scene.name, group.name
    value = emitter_values(group)
    asked = {"entry": group.model} if value is None else {"value": value}
    if value is not None and scene.optisense.folder:
        asked["folder"] = scene.optisense.folder

    def known(result: dict[str, Any]) -> None:
        scene = bpy.data.scenes.get(name)
        group = None if scene is None else scene.optisense.light_groups.get(lamps)
        if group is not None and emitter_values(group) == value:
            group.drawn = json.dumps(result)
            redraw(scene, group)

    session.ask("lamp", known, lambda error: None, **asked)


def _reshaped(scene: bpy.types.Scene, group: bpy.types.PropertyGroup) -> None:
    if session.running() is not None:
        ask_for_window(scene, group)


HOOKS = ((properties.when_reshaped, _reshaped),)
