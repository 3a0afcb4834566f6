"""Relighting: a change of a light group's flux or colour shows at once, without rendering."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from ..core.engine import Engine, EngineError, Request
from ..core.numbers import short
from ..engine import session
from ..scene.properties import when_relit
from ..scene.subject import Subject
from . import picture
from .exposure import exposure, keep_exposure, shown_size, when_exposed

NAME = "relit"
AGAIN = "Simulate again to see these lights"

_open: Request | None = None
_wanted = False
_shown: dict[str, Any] = {}
"""Lights of the picture that is shown, by group."""


def wanted() -> None:
    """Schedule relighting after a change of the light groups."""
    global _wanted
    now = bpy.context.window_manager.optisense_picture
    if not now.shown or now.other_sensor(bpy.context.scene):
        return
    if now.image and session.running() is not None:
        _wanted = True
        _ask()
    else:
        session.state().note = AGAIN


def shown(values: dict[str, Any]) -> None:
    """Store the lights of a new picture, by group, as in the engine's answer."""
    global _shown
    _shown = {
        name: {"flux": short(group["flux"]), "colour": [short(one) for one in group["colour"]]}
        for name, group in values.items()
    }


def lights(scene: bpy.types.Scene) -> dict[str, Any]:
    """Return the present flux and colour of all groups; hidden groups and black ones, which designs
    do not allow, are dark.
    """
    used = {each.optisense.group for each in scene.objects if each.optisense.kind == "LIGHT"}
    return {
        group.name: {
            "flux": short(group.flux),
            "colour": [short(channel) for channel in group.colour],
        }
        if group.shown and max(group.colour) > 0.0
        else {"flux": 0.0}
        for group in scene.optisense.light_groups
        if group.name in used
    }


def _ask() -> None:
    """Send a request if none is open; later changes are collected for the next one."""
    global _open, _wanted, _shown
    if not _wanted or (_open is not None and not _open.done):
        return
    engine = session.running()
    if engine is None:
        return
    _wanted = False
    scene = bpy.context.scene
    now = bpy.context.window_manager.optisense_picture
    if not now.is_of(scene):
        return
    _shown = lights(scene)
    subject = Subject(scene)
    _open = engine.send(
        "relight",
        on_result=subject.taking(_take),
        on_error=subject.taking(_refused),
        image=now.image,
        lights=_shown,
        exposure=exposure(scene),
        files=["pixels"],
        name=NAME,
    )


def _take(result: dict[str, Any], scene: bpy.types.Scene) -> None:
    picture.show(np.load(result["files"]["pixels"]), shown_size(scene))
    keep_exposure(scene, result["exposure"])
    bpy.context.window_manager.optisense_picture.is_relit = True
    session.redraw()


def _refused(error: EngineError, scene: bpy.types.Scene) -> None:
    # After lights were added, or if the engine has forgotten the picture, only rendering helps.
    bpy.context.window_manager.optisense_picture.image = ""
    session.state().note = AGAIN


@bpy.app.handlers.persistent
def _undone(*_: Any) -> None:
    """Relight after undo or redo, which change properties without calling their callbacks."""
    if lights(bpy.context.scene) != _shown:
        wanted()


def _leave() -> None:
    """Drop the open request before another .blend file is opened."""
    global _open, _wanted
    if _open is not None:
        _open.ignore()
    _open, _wanted = None, False


def _forget(_: Engine) -> None:
    """Forget the picture of an engine that has ended."""
    bpy.context.window_manager.optisense_picture.image = ""


HOOKS = (
    (session.when_ticking, _ask),
    (session.when_started, _forget),
    (session.when_leaving, _leave),
    (when_relit, wanted),
    (when_exposed, wanted),
    (bpy.app.handlers.undo_post, _undone),
    (bpy.app.handlers.redo_post, _undone),
)


def unregister() -> None:
    _leave()
