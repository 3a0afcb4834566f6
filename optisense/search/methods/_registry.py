"""Registry of search methods: those of this package and those of other packages."""

from __future__ import annotations

import inspect
from typing import Any

from optisense.errors import SearchError
from optisense.near import suggestion
from optisense.registry import Registry
from optisense.search.methods.base import Method, Problem

METHODS: Registry[type[Method]] = Registry(
    "search method",
    "optisense.methods",
    SearchError,
    {
        "grid": "optisense.search.methods._grid:Grid",
        "random": "optisense.search.methods._random_search:Random",
        "cma-es": "optisense.search.methods._cma_es:CmaEs",
        "gradient": "optisense.search.methods.gradient:Gradient",
        "pareto": "optisense.search.methods._pareto:Pareto",
        "light-colours": "optisense.search.methods._light_colours:LightColours",
        "types": "optisense.search.methods._light_types:LightTypes",
    },
)

find, names = METHODS.find, METHODS.names


def register(method: type[Method]) -> type[Method]:
    """Add a method under its `name`; usable as a class decorator.

    Raises:
        SearchError: another method has this name.
    """
    return METHODS.register(method.name, method)


def make(name: str, problem: Problem, options: dict[str, Any] | None = None) -> Method:
    """Return an instance of a method for a problem.

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
