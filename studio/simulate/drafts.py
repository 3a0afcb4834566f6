"""Draft mode: a small picture follows while lights, the camera, cages or contacts are moved."""

from __future__ import annotations

import time
from typing import Any

import bpy

from ..core.engine import EngineError, Request
from ..engine import handing, session
from ..scene.collections import is_edited
from . import requests
from .exposing import exposure

NAME = "draft"
NONE = "No draft: "
KINDS = ("PART", "LIGHT", "CAMERA", "CAGE", "CONTACT")

MOST_OPEN = 3
"""Drafts: one that is made, one that waits, and the one that this took the place of, until the
engine has answered it."""
RENEWED = 0.05
"""Seconds after which a draft that waits for another to be made gives way to a newer one."""
REST = 0.3
"""Seconds without a change after which a draft that took things over is made once more, anew."""

_open: list[Request] = []
_wanted = False
_sent = 0.0
_again: float | None = None
"""When to ask once more, if nothing changes before."""


def wanted() -> None:
    """Something changed that a picture would show: ask as soon as Blender is done with it."""
    global _wanted, _again
    _wanted, _again = True, None
    if session.running() is not None and not bpy.app.timers.is_registered(_soon):
        bpy.app.timers.register(_soon, first_interval=0.0)


def _soon() -> None:
    """Once, instead of at the next look at the engine, which may be a twentieth second away."""
    _ask()


def _ask() -> None:
    """Ask for a draft if one is wanted: one is made, and the newest waits behind it, so that the
    engine goes from one to the next at once."""
    global _wanted, _sent, _again
    scene = bpy.context.scene
    if scene is None or not scene.optisense_simulation.draft or session.is_busy():
        return
    now = time.monotonic()
    _open[:] = [each for each in _open if not each.done]
    rested = _again is not None and now >= _again and not _open
    if not (_wanted or rested) or len(_open) == MOST_OPEN:
        return
    if len(_open) > 1 and now - _sent < RENEWED:
        return
    _wanted, _sent, _again = False, now, None
    if not scene.optisense.is_open:
        return
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
    """Show a draft, and see to it that one that took things over does not stay."""
    global _again
    requests.take(result, draft=True)
    if session.state().note.startswith(NONE):
        session.state().note = ""
    settings = result["settings"]
    if (settings.get("kept_layers") or settings.get("kept_media")) and not _wanted:
        _again = time.monotonic() + REST


def _refused(error: EngineError) -> None:
    if error.kind not in ("Replaced", "Cancelled"):
        session.state().note = f"{NONE}{error.message}"  # nothing is selected in mid-movement
        session.redraw()


def _leave() -> None:
    """Another .blend file is opened: no draft of this one is wanted any more."""
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
