"""The registry of search methods: those of the package and those that other packages bring."""

from __future__ import annotations

import inspect
from importlib import import_module
from importlib.metadata import entry_points
from typing import Any

from optisense.design.near import suggestion
from optisense.errors import SearchError
from optisense.search.methods.base import Method, Problem

ENTRY_POINTS = "optisense.methods"
"""Installed packages add methods under this group: name = "module:Class"."""

HOMES = {
    "grid": "optisense.search.methods.grid:Grid",
    "random": "optisense.search.methods.random_search:Random",
    "cma-es": "optisense.search.methods.cma_es:CmaEs",
    "gradient": "optisense.search.methods.gradient:Gradient",
    "pareto": "optisense.search.methods.pareto:Pareto",
    "light-colours": "optisense.search.methods.light_colours:LightColours",
    "types": "optisense.search.methods.light_types:LightTypes",
}
"""The built-in methods, loaded when they are asked for."""

_registered: dict[str, type[Method]] = {}


def register(method: type[Method]) -> type[Method]:
    """Add a method by its `name`; usable as a class decorator.

    Raises:
        SearchError: another one has this name.
    """
    old = _registered.get(method.name)
    home = f"{method.__module__}:{method.__qualname__}"
    if HOMES.get(method.name, home) != home or (
        old is not None and f"{old.__module__}:{old.__qualname__}" != home
    ):
        raise SearchError(
            f"there is already a method '{method.name}'", where=home, hint="Give it another name"
        )
    _registered[method.name] = method
    return method


def find(name: str) -> type[Method]:
    """The method of a name.

    Raises:
        SearchError: there is none (the near match is named), or it can't be loaded.
    """
    key = name.strip().lower()
    if key in _registered:
        return _registered[key]
    if key in HOMES:
        module, _, attribute = HOMES[key].partition(":")
        found: type[Method] = getattr(import_module(module), attribute)
        return found
    for point in entry_points(group=ENTRY_POINTS):
        if point.name == key:
            try:
                return register(point.load())
            except Exception as error:
                raise SearchError(
                    f"the method '{key}' can't be loaded: {type(error).__name__}: {error}",
                    where=point.value,
                ) from error
    raise SearchError(f"there is no method '{name}'", hint=suggestion(key, names()))


def names() -> list[str]:
    """All methods: the built-in ones first."""
    offered = {point.name for point in entry_points(group=ENTRY_POINTS)}
    return [*HOMES, *sorted((offered | set(_registered)) - set(HOMES))]


def make(name: str, problem: Problem, options: dict[str, Any] | None = None) -> Method:
    """A method, ready to be asked.

    Raises:
        SearchError: the name or an option is unknown, or the problem does not fit the method.
    """
    kind = find(name)
    known = list(inspect.signature(kind.__init__).parameters)[2:]
    for key in options or {}:
        if key not in known:
            hint = suggestion(key, known) or f"{name} takes no options"
            raise SearchError(f"{name} has no option '{key}'", hint=hint)
    try:
        return kind(problem, **(options or {}))
    except TypeError as error:
        raise SearchError(f"an option of {name} has the wrong type: {error}") from error
