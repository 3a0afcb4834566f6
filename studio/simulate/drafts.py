"""Draft mode: a small picture follows while lights, the camera, cages or contacts are moved."""

from __future__ import annotations

import bpy

from ..core.engine import EngineError, Request
from ..engine import handing, session
from ..scene.contacts import contact_list
from . import requests

NAME = "draft"
KINDS = ("PART", "LIGHT", "CAMERA", "CAGE", "CONTACT")

_open: Request | None = None
_wanted = False


def wanted() -> None:
    """Something changed that a picture would show: ask as soon as Blender is done with it."""
    global _wanted
    _wanted = True
    if session.running() is not None and not bpy.app.timers.is_registered(_soon):
        bpy.app.timers.register(_soon, first_interval=0.0)


def _soon() -> None:
    """Once, instead of at the next look at the engine, which may be a twentieth second away."""
    _ask()


def _ask() -> None:
    """One draft at a time; what changes meanwhile goes into the next."""
    global _open, _wanted
    scene = bpy.context.scene
    if not _wanted or scene is None or not scene.optisense_simulation.draft:
        return
    if (_open is not None and not _open.done) or session.is_busy():
        return
    _wanted = False
    if not scene.optisense.is_open:
        return
    try:
        design = handing.design(scene)
        contacts = contact_list(scene, bpy.context.evaluated_depsgraph_get())
        _open = session.engine().send(
            "simulate",
            on_result=lambda result: requests.take(result, draft=True),
            on_error=_refused,
            design=design,
            contacts=contacts,
            draft=True,
            files=["pixels"],
            name=NAME,
        )
    except EngineError as error:
        session.say(error)


def _refused(error: EngineError) -> None:
    if error.kind not in ("Replaced", "Cancelled"):
        session.state().note = f"No draft: {error.message}"
        session.redraw()


@bpy.app.handlers.persistent
def _changed(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    if not scene.optisense_simulation.draft:
        return
    for update in depsgraph.updates:
        item = update.id.original
        if isinstance(item, bpy.types.Object) and item.optisense.kind in KINDS:
            wanted()
            return


def register() -> None:
    bpy.app.handlers.depsgraph_update_post.append(_changed)
    session.on_tick(_ask)


def unregister() -> None:
    global _open, _wanted
    if bpy.app.timers.is_registered(_soon):
        bpy.app.timers.unregister(_soon)
    bpy.app.handlers.depsgraph_update_post.remove(_changed)
    _open, _wanted = None, False
