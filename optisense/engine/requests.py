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
from optisense.errors import OptiSenseError
from optisense.near import suggestion
from optisense.own_code import error_of_own_code
from optisense.registry import Registry

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
        "skin",
        "fitting",
        "designing",
        "cad",
        "library_requests",
        "scoring",
        "searching",
    ):
        import_module(f"optisense.engine.{module}")


T = TypeVar("T")
Rows = list[dict[str, Any]]


def listed(registry: Registry[T], row: Callable[[str, T], dict[str, Any]]) -> tuple[Rows, Rows]:
    """Return the rows of all objects of a registry, and name and message of those without a row.

    An object of another package that can't be loaded or described leaves the others in the list.

    Args:
        row: function that returns the row of an object, called with its name and the object.
    """
    failures: dict[str, OptiSenseError] = {}
    rows = []
    for name, thing in registry.loadable(failures):
        try:
            rows.append(row(name, thing))
        except Exception as error:
            if name in registry.built_in:
                raise
            told = error if isinstance(error, OptiSenseError) else error_of_own_code(error)
            failures[name] = told or OptiSenseError(f"{type(error).__name__}: {error}")
    return rows, [{"name": name, "message": str(error)} for name, error in failures.items()]
