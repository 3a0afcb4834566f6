"""What happens by itself when Blender starts or opens a file: the engine warms up."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import bpy

from ..core.engine import EngineError
from ..engine import session
from ..engine.preferences import engine_command
from .opening import open_source, picture_is_old
from .warming import warm_up

SOON = 0.5
"""Seconds after Blender's start at which the extension begins its work, when the window stands."""
ENVIRONMENT = "OPTISENSE_OPEN"
"""Names the design that `optisense studio DESIGN` was asked to open."""


def _start() -> None:
    if not engine_command():
        return
    source = os.environ.pop(ENVIRONMENT, "")
    try:
        session.engine()
        if source:
            folder = source if Path(source).is_dir() else ""
            open_source(bpy.context.scene, source, folder, wait=False)
        elif bpy.context.scene.optisense.is_open:
            warm_up(bpy.context.scene)
    except EngineError as error:
        session.say(error)


@bpy.app.handlers.persistent
def _loaded(*_: Any) -> None:
    """A .blend file was opened, with a sensor or without: the picture is of another one."""
    picture_is_old()
    scene = bpy.context.scene
    if not bpy.app.background and scene.optisense.is_open and session.running() is not None:
        warm_up(scene)


HOOKS = ((bpy.app.handlers.load_post, _loaded),)


def register() -> None:
    if not bpy.app.background:
        bpy.app.timers.register(_start, first_interval=SOON)


def unregister() -> None:
    if bpy.app.timers.is_registered(_start):
        bpy.app.timers.unregister(_start)
