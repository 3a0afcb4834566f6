"""Preparation of the engine to simulate a sensor, while the user looks at it."""

from __future__ import annotations

import bpy

from ..core.engine import EngineError, Request
from ..engine import design_transfer, session

START = "builtin:gelsight-mini"
"""Sensor for which the engine is prepared before any is open: a new sensor is usually this one, and
most of the work is the same for all."""

_open: Request | None = None
_is_put_off = False
_prepared: int | None = None
"""Process number of the engine that was prepared before a sensor was open."""


def prepare() -> None:
    """Let a new engine load the renderer and compile its code while no sensor is open."""
    global _open, _prepared
    engine = session.running()
    if bpy.app.background or engine is None or engine.pid == _prepared:
        return
    _prepared = engine.pid
    _open = engine.send("warm", design=START, contacts=True, drafts=True)


def warm_up(scene: bpy.types.Scene) -> Request | None:
    """Let the engine build the scene's sensor and compile the code for a picture, without waiting.

    A picture requested meanwhile is made right after that, no later than without this. The request
    for an earlier sensor is cancelled.
    """
    global _open, _is_put_off
    _is_put_off = False
    try:
        engine = session.engine()
        if _open is not None:
            engine.cancel(_open)
        _open = engine.send(
            "warm", design=design_transfer.design(scene), contacts=True, drafts=True
        )
    except EngineError:  # Simulating will show the error.
        return None
    return _open


def put_off() -> None:
    """Cancel a running preparation, since a draft that is wanted is ready sooner without it."""
    global _open, _is_put_off
    if _open is not None and not _open.done and session.running() is not None:
        session.engine().cancel(_open)
        _is_put_off = True
    _open = None


def is_put_off() -> bool:
    """Return whether a preparation was cancelled and has not been repeated yet."""
    return _is_put_off
