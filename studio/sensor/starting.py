"""What happens by itself when Blender starts: the engine warms up, and a design opens."""

from __future__ import annotations

import os
from pathlib import Path

import bpy

from ..core.engine import EngineError
from ..engine import session
from ..engine.preferences import engine_command
from .opening import open_source

SOON = 0.5
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
    except EngineError as error:
        session.say(error)


def register() -> None:
    if not bpy.app.background:
        bpy.app.timers.register(_start, first_interval=SOON)


def unregister() -> None:
    if bpy.app.timers.is_registered(_start):
        bpy.app.timers.unregister(_start)
