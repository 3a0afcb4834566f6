"""Draft mode: a small picture is updated while lights, the camera, cages or contacts are moved."""

from __future__ import annotations

import time
from typing import Any

import bpy

from ..core.engine import EngineError, Request
from ..engine import design_transfer, session
from ..scene.collections import is_edited
from ..scene.subject import Subject
from ..sensor import opening, warming
from . import requests, stored_drafts
from .exposure import exposure

NAME = "draft"
NONE = "No draft: "
KINDS = ("PART", "LIGHT", "CAMERA", "CAGE", "CONTACT")

MOST_OPEN = 3
"""Largest number of open drafts: one in progress, one waiting, one replaced but unanswered."""
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
_opened = False
"""Whether a sensor was opened whose first draft was not requested yet."""


def wanted() -> None:
    """Schedule a draft: something that a picture would show changed."""
    global _wanted, _again
    _wanted, _again = True, None
    if session.running() is not None and not bpy.app.timers.is_registered(_soon):
        bpy.app.timers.register(_soon, first_interval=0.0)


def _soon() -> None:
    """Run `_ask` now, not at the next poll of the engine up to a twentieth of a second later."""
    _ask()


def _ask() -> None:
    """Request a draft if one is wanted. The newest waits behind the one in progress, so that the
    engine never idles between them.
    """
    global _wanted, _sent, _began, _again, _opened
    scene = bpy.context.scene
    if scene is None or session.is_busy():
        return
    now = time.monotonic()
    _open[:] = [each for each in _open if not each.done]
    rested = _again is not None and now >= _again and not _open
    wanted = scene.optisense_simulation.draft and (_wanted or rested)
    if not (wanted or _opened) or len(_open) == MOST_OPEN:
        if not _open and _again is None and now - _began > REST and warming.is_put_off():
            warming.warm_up(scene)
        return
    if _open and now < max(_began + _pace - LEAD, _sent + RENEWED * (len(_open) > 1)):
        return
    first, _opened = _opened, False
    _wanted, _sent, _again = False, now, None
    if not _open:
        _began = now
    if not scene.optisense.is_open:
        return
    warming.put_off()
    subject = Subject(scene)
    refused = _ignored if first else subject.taking(_refused)
    try:
        design = design_transfer.design(scene)
        contacts = design_transfer.contacts(scene)
        what = stored_drafts.shown_by(scene, design, contacts)
        _open.append(
            session.engine().send(
                "simulate",
                on_result=lambda result: _take(result, subject, what),
                on_error=refused,
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
        refused(error)


def _first(scene: bpy.types.Scene, draft: str | None) -> None:
    """Show a stored draft of an opened sensor, and schedule its first draft.

    The first draft is made even if drafts are switched off. Scripts ask for what they need.
    """
    global _opened
    if not bpy.app.background:
        if not stored_drafts.show_kept(scene):
            stored_drafts.show_built_in(scene, draft)
        _opened = True


def _take(result: dict[str, Any], subject: Subject, what: list[Any] | None) -> None:
    """Show a draft, and schedule a complete one if it reused earlier results.

    The draft is dropped if the user left its scene or opened another sensor.

    Args:
        what: all that the draft depends on; None if it is not to be stored.
    """
    global _again, _began, _pace
    now = time.monotonic()
    _began, _pace = now, now - _began
    scene = bpy.context.scene
    if subject.scene != scene:
        return
    requests.take(result, subject, draft=True)
    if session.state().note.startswith(NONE):
        session.state().note = ""
    settings = result["settings"]
    if _wanted:
        return
    if scene.optisense_simulation.draft and any(settings.get(each) for each in REUSED):
        _again = time.monotonic() + REST
    elif all(each.done for each in _open):
        stored_drafts.keep(what, result)


def _ignored(_: EngineError) -> None:
    """Ignore the error of a draft that the user did not ask for; *Check* and *Simulate* show it."""


def _refused(error: EngineError, scene: bpy.types.Scene) -> None:
    if error.kind not in ("Replaced", "Cancelled") and scene == bpy.context.scene:
        session.state().note = f"{NONE}{error.message}"  # `say` would change the selection
        session.redraw()


def _leave() -> None:
    """Drop the open drafts before another .blend file is opened."""
    global _wanted, _again, _opened
    for each in _open:
        each.ignore()
    _open.clear()
    _wanted, _again, _opened = False, None, False


@bpy.app.handlers.persistent
def _changed(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    if scene.optisense_simulation.draft and is_edited(depsgraph, *KINDS):
        wanted()


HOOKS = (
    (bpy.app.handlers.depsgraph_update_post, _changed),
    (opening.when_opened, _first),
    (session.when_ticking, _ask),
    (session.when_leaving, _leave),
)


def unregister() -> None:
    if bpy.app.timers.is_registered(_soon):
        bpy.app.timers.unregister(_soon)
    _leave()
