"""The engine is started with the extension, so that the first picture need not wait for it."""

from __future__ import annotations

import bpy

from ..core.engine import EngineError
from . import session
from .preferences import engine_command

SOON = 0.5


def _start() -> None:
    if engine_command():
        try:
            session.engine()
        except EngineError as error:
            session.say(error)


def register() -> None:
    if not bpy.app.background:
        bpy.app.timers.register(_start, first_interval=SOON)


def unregister() -> None:
    if bpy.app.timers.is_registered(_start):
        bpy.app.timers.unregister(_start)
