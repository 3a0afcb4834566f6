"""While the user looks at an opened sensor, the engine gets ready to simulate it."""

from __future__ import annotations

import bpy

from ..core.engine import EngineError, Request
from ..engine import handing, session

_open: Request | None = None


def warm_up(scene: bpy.types.Scene) -> Request | None:
    """Let the engine build the scene's sensor and compile what a picture needs; nobody waits.

    A picture that is asked for meanwhile is made as soon as that is done, which is no later than
    without. Only the sensor opened last is of interest.
    """
    global _open
    try:
        engine = session.engine()
        if _open is not None:
            engine.cancel(_open)
        _open = engine.send("warm", design=handing.design(scene), contacts=True, drafts=True)
    except EngineError:  # simulating will say it
        return None
    return _open
