"""Scores that trace rays only, kept up to date while the sensor is edited."""

from __future__ import annotations

import time
from typing import Any

import bpy

from ..core.engine import EngineError, Request
from ..engine import catalogue, handing, session
from ..scene.collections import is_edited
from . import prop
from .operator import chosen, take_live

KINDS = ("PART", "CAMERA", "CAGE")

REST = 0.2
"""Seconds without a change after which an edited sensor is scored: a score takes the engine some
hundredths of a second and checks the sensor first, which pictures of a drag need not wait for."""

_open: Request | None = None
_when: float | None = None
"""When to score, if nothing changes before."""


def objectives(context: bpy.types.Context) -> list[str]:
    """The ticked objectives that trace rays only."""
    quick = {row["name"] for row in catalogue.entries("objectives") if row.get("rays_only")}
    return [name for name in chosen(context) if name in quick]


def wanted() -> None:
    """The sensor changed, or scoring while editing was switched on."""
    global _when
    values = bpy.context.window_manager.optisense_evaluation
    _when = time.monotonic() + REST if values.live else None


def _ask() -> None:
    global _open, _when
    scene = bpy.context.scene
    if _when is None or time.monotonic() < _when or session.is_busy():
        return
    if _open is not None and not _open.done:
        return
    _when = None
    names = objectives(bpy.context)
    if scene is None or not scene.optisense.is_open or not names:
        return
    try:
        design = handing.design(scene)
    except EngineError:  # the buttons say that
        return
    _open = session.ask(
        "evaluate", take_live, _refused, design=design, objectives=names, name="live"
    )


def _refused(error: EngineError) -> None:
    """What is wrong in the middle of an edit, Check and Evaluate tell."""


def _leave() -> None:
    global _open, _when
    if _open is not None:
        _open.ignore()
    _open = _when = None


@bpy.app.handlers.persistent
def _changed(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    if bpy.context.window_manager.optisense_evaluation.live and is_edited(depsgraph, *KINDS):
        wanted()


HOOKS: tuple[tuple[Any, Any], ...] = (
    (prop.when_live_changed, wanted),
    (session.when_ticking, _ask),
    (session.when_leaving, _leave),
    (bpy.app.handlers.depsgraph_update_post, _changed),
)


def unregister() -> None:
    _leave()
