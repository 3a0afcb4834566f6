"""Preparation of the engine to simulate a sensor, while the user looks at it."""

from __future__ import annotations

import bpy

from ..core.engine import EngineError, Request
from ..engine import handing, session

_open: Request | None = None


def warm_up(scene: bpy.types.Scene) -> Request | None:
    """Let the engine build the scene's sensor and compile the code for a picture, without waiting.

    A picture requested meanwhile is made right after that, no later than without this. The request
    for an earlier sensor is cancelled.
    """
    global _open
    try:
        engine = session.engine()
        if _open is not None:
            engine.cancel(_open)
        _open = engine.send("warm", design=handing.design(scene), contacts=True, drafts=True)
    except EngineError:  # Simulating will show the error.
        return None
    return _open
