"""Actions when Blender starts or opens a file: the engine warms up."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import bpy

from ..core.engine import EngineError
from ..engine import session
from ..engine.preferences import engine_command
from ..scene.startup import clear_startup
from . import workspace
from .opening import open_source, picture_is_old
from .warming import warm_up

SOON = 0.5
"""Delay (s) after Blender's start before the extension begins its work, for the window to exist."""
ENVIRONMENT = "OPTISENSE_OPEN"
"""Environment variable with the design that `optisense studio DESIGN` was asked to open."""


_hidden = False
"""Whether this module has switched Blender's splash screen off."""


def _start() -> None:
    _splash(True)
    if not engine_command():
        return
    source = os.environ.pop(ENVIRONMENT, "")
    try:
        session.engine()
        if source:
            clear_startup(bpy.context.scene)
            workspace.show(bpy.context)
            folder = source if Path(source).is_dir() else ""
            open_source(bpy.context.scene, source, folder, wait=False)
        elif bpy.context.scene.optisense.is_open:
            warm_up(bpy.context.scene)
    except EngineError as error:
        session.say(error)


@bpy.app.handlers.persistent
def _loaded(*_: Any) -> None:
    """Mark the picture as outdated after a .blend file was opened, and warm the engine up."""
    picture_is_old(None)
    scene = bpy.context.scene
    if not bpy.app.background and scene.optisense.is_open and session.running() is not None:
        warm_up(scene)


def _splash(is_shown: bool) -> None:
    """Hide Blender's splash screen while a design is opened, or show it at the next start."""
    global _hidden
    preferences = bpy.context.preferences
    if _hidden == (not is_shown):
        return
    changed = preferences.is_dirty
    preferences.view.show_splash = is_shown
    preferences.is_dirty = changed
    _hidden = not is_shown


HOOKS = ((bpy.app.handlers.load_post, _loaded),)


def register() -> None:
    if not bpy.app.background:
        if os.environ.get(ENVIRONMENT) and bpy.context.preferences.view.show_splash:
            _splash(False)
        bpy.app.timers.register(_start, first_interval=SOON)


def unregister() -> None:
    if bpy.app.timers.is_registered(_start):
        bpy.app.timers.unregister(_start)
