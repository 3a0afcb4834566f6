"""Registry of the engine's requests: their fields, their queue, and their handler."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from importlib import import_module
from typing import Any, TypeVar

from optisense.engine.failures import ProtocolError
from optisense.engine.jobs import Job
from optisense.engine.protocol import Fields
from optisense.engine.session import Session
from optisense.near import suggestion

Handler = Callable[[Session, Any, Job], dict[str, Any]]


class Lane(Enum):
    """Queue that carries out a request."""

    QUICK = "quick"  # needs no renderer; one after another
    RENDER = "render"  # needs the renderer; one after another
    OWN = "own"  # in a thread of its own, since it mostly waits


@dataclass(frozen=True)
class Kind:
    """Kind of request."""

    do: str
    fields: type[Fields]
    lane: Lane
    handler: Handler


_kinds: dict[str, Kind] = {}

_H = TypeVar("_H", bound=Callable[..., dict[str, Any]])


def handles(do: str, fields: type[Fields], lane: Lane) -> Callable[[_H], _H]:
    """Register a function `(session, fields, job) -> result` for a kind of request."""

    def register(function: _H) -> _H:
        _kinds[do] = Kind(do, fields, lane, function)
        return function

    return register


def find(do: str, others: tuple[str, ...] = ()) -> Kind:
    """Return the kind of request with this name.

    Raises:
        ProtocolError: there is none; the message suggests a similar name.
    """
    _load()
    if do not in _kinds:
        hint = suggestion(do, [*_kinds, *others], limit=60)
        raise ProtocolError(f"there is no request '{do}'", where="do", hint=hint)
    return _kinds[do]


def names() -> list[str]:
    """Return the names of all kinds of requests."""
    _load()
    return list(_kinds)


def _load() -> None:
    """Import the modules that register requests; not at the start, so that `hello` is fast."""
    for module in (
        "rendering",
        "footprint",
        "fitting",
        "placing",
        "designing",
        "cad",
        "library_requests",
        "kinds",
        "scoring",
        "searching",
    ):
        import_module(f"optisense.engine.{module}")
