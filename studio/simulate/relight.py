"""Relighting: a change of a light group's flux or colour shows at once, without rendering."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from ..core.engine import EngineError, Request
from ..core.numbers import short
from ..engine import session
from ..scene.properties import when_relit
from . import picture

NAME = "relit"

_open: Request | None = None
_wanted = False


def wanted() -> None:
    """The light groups changed: show the picture under the new lights, as soon as may be."""
    global _wanted
    now = bpy.context.window_manager.optisense_picture
    if now.shown and now.image and session.running() is not None:
        _wanted = True
        _ask()


def lights(scene: bpy.types.Scene) -> dict[str, Any]:
    """All groups as they are now."""
    used = {each.optisense.group for each in scene.objects if each.optisense.kind == "LIGHT"}
    return {
        group.name: {
            "flux": short(group.flux),
            "colour": [short(channel) for channel in group.colour],
        }
        for group in scene.optisense.light_groups
        if group.name in used and max(group.colour) > 0.0
    }


def _ask() -> None:
    """One request at a time; what changes meanwhile goes into the next."""
    global _open, _wanted
    if not _wanted or (_open is not None and not _open.done):
        return
    engine = session.running()
    if engine is None:
        return
    _wanted = False
    image = bpy.context.window_manager.optisense_picture.image
    _open = engine.send(
        "relight",
        on_result=_take,
        on_error=_refused,
        image=image,
        lights=lights(bpy.context.scene),
        files=["pixels"],
        name=NAME,
    )


def _take(result: dict[str, Any]) -> None:
    picture.show(np.load(result["files"]["pixels"]))
    bpy.context.window_manager.optisense_picture.is_relit = True
    session.redraw()


def _refused(error: EngineError) -> None:
    # Lights that were added since, or a picture the engine forgot: only rendering helps.
    bpy.context.window_manager.optisense_picture.image = ""
    session.state().note = "Simulate again to see these lights"


def register() -> None:
    session.on_tick(_ask)
    when_relit.append(wanted)


def unregister() -> None:
    global _open, _wanted
    _open, _wanted = None, False
    when_relit.remove(wanted)
