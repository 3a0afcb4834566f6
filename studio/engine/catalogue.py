"""The engine's catalogue, queried when it starts: sensors, library, objectives, methods."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy

from ..core import schema
from ..core.engine import Engine
from . import session

Items = list[tuple[str, str, str]]

LIBRARY_KINDS = ("material", "coating", "light", "camera")

_lists: dict[str, list[dict[str, Any]]] = {}
_items: dict[str, Items] = {}
_NONE: Items = [("NONE", "(the engine is starting)", "Wait a moment, then open this again")]
_NO_ENGINE: Items = [("NONE", "(no engine runs)", "The panel Sensor says what to do")]


def entries(name: str) -> list[dict[str, Any]]:
    """Return the engine's entries for `sensors`, `objectives`, `methods` or a library kind."""
    return _lists.get(name, [])


def items(name: str) -> Items:
    """Return the same entries as items of a menu; Blender requires that the strings stay alive."""
    return _items.get(name) or (_NONE if session.running() is not None else _NO_ENGINE)


def objectives(_values: bpy.types.PropertyGroup, _context: bpy.types.Context | None) -> Items:
    """Return the objectives in the form of an items callback of an `EnumProperty`."""
    return items("objectives")


def refresh(engine: Engine) -> None:
    """Request all lists; they are available when the engine has answered."""
    for what, name in (
        ("sensors", "sensors"),
        ("objectives", "objectives"),
        ("methods", "methods"),
        ("calibration_families", "families"),
    ):
        engine.send(
            what,
            on_result=lambda result, what=what, name=name: _keep(what, result[name]),
        )
    engine.send("kinds", on_result=schema.learn)
    for kind in LIBRARY_KINDS:
        refresh_library(engine, kind)


def learn_kinds() -> None:
    """Wait until the engine's kinds and their fields are known.

    Raises:
        EngineError: there is no engine, or it does not answer.
    """
    if not schema.is_known():
        schema.learn(session.ask_and_wait("kinds"))


def refresh_library(engine: Engine, kind: str, then: Callable[[], None] | None = None) -> None:
    """Request a kind of the library again, and call `then` when it has arrived."""

    def learn(result: dict[str, Any]) -> None:
        _keep(kind, result["entries"])
        if then is not None:
            then()

    engine.send("library", kind=kind, on_result=learn)


def _keep(name: str, rows: list[dict[str, Any]]) -> None:
    _lists[name] = rows
    _items[name] = [
        (
            row["name"],
            row.get("title") or row["name"],
            row.get("description") or row.get("summary") or "",
        )
        for row in rows
    ]
    session.redraw()


HOOKS = ((session.when_started, refresh),)


def unregister() -> None:
    schema.learn({})
    _lists.clear()
    _items.clear()
