"""How large the library's lights are, to draw them in their real size."""

from __future__ import annotations

import json
from typing import Any

import bpy

from ..engine import session
from ..scene.lamps import redraw


def ask_for_windows(scene: bpy.types.Scene) -> None:
    """Ask the engine for the windows of all library lights of a design, and draw them."""
    name = scene.name
    models = {each.model for each in scene.optisense.light_groups if each.emitter == "library"}
    for model in sorted(models):

        def known(result: dict[str, Any], model: str = model) -> None:
            window = window_of(result["entry"])
            scene = bpy.data.scenes.get(name)
            if window is None or scene is None:
                return
            for group in scene.optisense.light_groups:
                if group.model == model and group.emitter == "library":
                    group.library_window = json.dumps(window)
                    redraw(scene, group)

        session.ask("entry", known, lambda error: None, kind="light", entry=model)


def window_of(entry: dict[str, Any]) -> dict[str, Any] | None:
    """Shape, size (mm) and half angle (degrees) of a library light; None where it says none."""
    return _find(entry)


def _find(values: Any) -> dict[str, Any] | None:
    if not isinstance(values, dict):
        return None
    if values.get("kind") == "spot" and "cutoff" in values:
        return {"shape": "disc", "size": [0.6, 0.6], "angle": values["cutoff"]}
    if isinstance(values.get("size"), list) and len(values["size"]) == 2:
        return {"shape": values.get("shape", "rectangle"), "size": values["size"], "angle": 60.0}
    found = (_find(each) for each in values.values())
    return next((each for each in found if each is not None), None)
