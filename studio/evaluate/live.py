"""Scores that only trace rays, updated while the sensor is edited."""

from __future__ import annotations

from typing import Any

import bpy

from ..engine import catalogue, session
from ..engine.latest_request import LatestRequest
from ..scene.collections import is_edited
from . import prop
from .operator import chosen, take_live

KINDS = ("PART", "CAMERA", "CAGE")

REST = 0.2
"""Time without a change after which an edited sensor is scored, s: a score takes the engine some
hundredths of a second and checks the design first, for which the pictures of a drag need not wait.
"""

_request = LatestRequest(REST)


def objectives(context: bpy.types.Context) -> list[str]:
    """Return the chosen objectives that only trace rays."""
    quick = {row["name"] for row in catalogue.entries("objectives") if row.get("rays_only")}
    return [name for name in chosen(context) if name in quick]


def wanted() -> None:
    """Schedule a score: the sensor changed, or live scoring was switched."""
    if bpy.context.window_manager.optisense_evaluation.live:
        _request.want()
    else:
        _request.drop()


def _ask() -> None:
    if not _request.is_due:
        return
    scene, names = bpy.context.scene, objectives(bpy.context)
    if scene is not None and scene.optisense.is_open and names:
        _request.send("evaluate", take_live, objectives=names, name="live")
    else:
        _request.drop()


@bpy.app.handlers.persistent
def _changed(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    if bpy.context.window_manager.optisense_evaluation.live and is_edited(depsgraph, *KINDS):
        wanted()


HOOKS: tuple[tuple[Any, Any], ...] = (
    (prop.when_live_changed, wanted),
    (session.when_ticking, _ask),
    (session.when_leaving, _request.leave),
    (bpy.app.handlers.depsgraph_update_post, _changed),
)


def unregister() -> None:
    _request.leave()
