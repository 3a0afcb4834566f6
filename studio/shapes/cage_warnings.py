"""Results of the engine's check about a cage, shown beside it once the cage is at rest."""

from __future__ import annotations

import re
from typing import Any

import bpy

from ..engine import session
from ..engine.latest_request import LatestRequest
from ..scene import cages

REST = 0.3
"""Time without a change after which a cage is checked, s: drafts of moved objects come first."""

_request = LatestRequest(REST)
_found: dict[tuple[int, str], list[dict[str, Any]]] = {}
"""Warnings by the session id of the scene and the name of the cage."""


def warnings_of(scene: bpy.types.Scene, key: str) -> list[dict[str, Any]]:
    """Return the engine's warnings about a cage, each with `severity`, `message` and `hint`."""
    return _found.get((scene.session_uid, key), [])


def _look() -> None:
    if not _request.is_due:
        return
    scene = bpy.context.scene
    if scene is not None and scene.optisense.is_open:
        _request.send("check", _take, lambda error, scene: _found.clear())
    else:
        _request.drop()


def _take(result: dict[str, Any], scene: bpy.types.Scene) -> None:
    _found.clear()
    for problem in result["problems"]:
        about = re.match(r"cages\.([^.\[]+)", problem["path"] or "")
        if about:
            _found.setdefault((scene.session_uid, about[1]), []).append(problem)
    session.redraw()


HOOKS = ((cages.when_bent, _request.want), (session.when_ticking, _look))


def unregister() -> None:
    _request.leave()
    _found.clear()
