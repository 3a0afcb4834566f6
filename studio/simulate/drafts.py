"""Draft mode: a small picture is updated while lights, the camera, cages or contacts are moved."""

from __future__ import annotations

import time
from typing import Any

import bpy

from ..core.engine import EngineError, Request
from ..engine import handing, session
from ..scene.collections import is_edited
from ..sensor import warming
from . import requests
from .exposing import exposure

NAME = "draft"
NONE = "No draft: "
KINDS = ("PART", "LIGHT", "CAMERA", "CAGE", "CONTACT")

MOST_OPEN = 3
"""Largest number of open drafts: one in progress, one waiting, and one that was replaced and not
yet answered.
"""
RENEWED = 0.05
"""Time after which a waiting draft is replaced by a newer one, s."""
LEAD = 0.05
"""Time before the expected end of the draft in progress at which the next one is requested, s. An
earlier request would be replaced by newer ones, each of which costs both processes time.
"""
REST = 0.3
"""Time without a change after which a draft that reused earlier results is made anew, s."""
REUSED = ("kept_layers", "kept_view", "kept_media")
"""Settings of a draft that tell whether it reused earlier results."""

_open: list[Request] = []
_wanted = False
_sent = 0.0
_began = 0.0
"""Time at which the engine began the draft in progress."""
_pace = 0.0
"""Duration of the last draft, s."""
_again: float | None = None
"""Time of one more draft if nothing changes before; None for none."""


def wanted() -> None:
    """Schedule a draft: something that a picture would show changed."""
    global _wanted, _again
    _wanted, _again = True, None
    if session.running() is not None and not bpy.app.timers.is_registered(_soon):
        bpy.app.timers.register(_soon, first_interval=0.0)


def _soon() -> None:
    """Run `_ask` at once, not at the next poll of the engine up to a twentieth of a second
    later.
    """
    _ask()


def _ask() -> None:
    """Request a draft if one is wanted. The newest waits behind the one in progress, so that the
    engine never idles between them.
    """
    global _wanted, _sent, _began, _again
    scene = bpy.context.scene
    if scene is None or not scene.optisense_simulation.draft or session.is_busy():
        return
    now = time.monotonic()
    _open[:] = [each for each in _open if not each.done]
    rested = _again is not None and now >= _again and not _open
    if not (_wanted or rested) or len(_open) == MOST_OPEN:
        if not _open and _again is None and now - _began > REST and warming.is_put_off():
            warming.warm_up(scene)
        return
    if _open and now < max(_began + _pace - LEAD, _sent + RENEWED * (len(_open) > 1)):
        return
    _wanted, _sent, _again = False, now, None
    if not _open:
        _began = now
    if not scene.optisense.is_open:
        return
    warming.put_off()
    try:
        design = handing.design(scene)
        contacts = handing.contacts(scene)
        _open.append(
            session.engine().send(
                "simulate",
                on_result=_take,
                on_error=_refused,
                design=design,
                contacts=contacts,
                draft=True,
                skin=scene.optisense_simulation.skin,
                exposure=exposure(scene),
                files=["pixels"],
                name=NAME,
            )
        )
    except EngineError as error:
        _refused(error)


def _take(result: dict[str, Any]) -> None:
    """Show a draft, and schedule a complete one if it reused earlier results."""
    global _again, _began, _pace
    now = time.monotonic()
    _began, _pace = now, now - _began
    requests.take(result, draft=True)
    if session.state().note.startswith(NONE):
        session.state().note = ""
    settings = result["settings"]
    if any(settings.get(each) for each in REUSED) and not _wanted:
        _again = time.monotonic() + REST


def _refused(error: EngineError) -> None:
    if error.kind not in ("Replaced", "Cancelled"):
        session.state().note = f"{NONE}{error.message}"  # `say` would change the selection
        session.redraw()


def _leave() -> None:
    """Drop the open drafts before another .blend file is opened."""
    global _wanted, _again
    for each in _open:
        each.ignore()
    _open.clear()
    _wanted, _again = False, None


@bpy.app.handlers.persistent
def _changed(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    if scene.optisense_simulation.draft and is_edited(depsgraph, *KINDS):
        wanted()


HOOKS = (
    (bpy.app.handlers.depsgraph_update_post, _changed),
    (session.when_ticking, _ask),
    (session.when_leaving, _leave),
)


def unregister() -> None:
    if bpy.app.timers.is_registered(_soon):
        bpy.app.timers.unregister(_soon)
    _leave()
