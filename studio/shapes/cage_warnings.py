"""Findings of the engine's check about a cage, shown beside it once the cage is at rest."""

from __future__ import annotations

import re
import time
from typing import Any

import bpy

from ..core.engine import EngineError, Request
from ..engine import handing, session
from ..scene import cages

REST = 0.3
"""Seconds without a change after which it is looked at: drafts of what is moved go first."""

_bent: float | None = None
"""When a cage was changed last, if that was not looked at yet."""

_open: Request | None = None
_found: dict[str, list[dict[str, Any]]] = {}


def warnings_of(key: str) -> list[dict[str, Any]]:
    """What is wrong with a cage, as the engine tells it: `severity`, `message`, `hint`."""
    return _found.get(key, [])


def _wanted() -> None:
    global _bent
    _bent = time.monotonic()


def _look() -> None:
    global _bent, _open
    waits = _open is not None and not _open.done
    if _bent is None or waits or time.monotonic() - _bent < REST or session.is_busy():
        return
    _bent, scene = None, bpy.context.scene
    if scene is None or not scene.optisense.is_open:
        return
    try:
        design = handing.design(scene)
    except EngineError:  # the buttons say that
        return
    _open = session.ask("check", _take, lambda _: _found.clear(), design=design)


def _take(result: dict[str, Any]) -> None:
    _found.clear()
    for problem in result["problems"]:
        about = re.match(r"cages\.([^.\[]+)", problem["path"] or "")
        if about:
            _found.setdefault(about[1], []).append(problem)
    session.redraw()


HOOKS = ((cages.when_bent, _wanted), (session.when_ticking, _look))


def unregister() -> None:
    global _bent, _open
    _bent = _open = None
    _found.clear()
