"""Registry of search methods: those of this package and those of other packages."""

from __future__ import annotations

import inspect
from typing import Any

from optisense.errors import OptiSenseError, SearchError
from optisense.keyword_types import as_type, types_of
from optisense.near import suggestion
from optisense.own_code import place_of
from optisense.registry import Registry, must_derive, place_of_definition
from optisense.search.methods.base import Method, Problem


def _check(name: str, kind: Any) -> None:
    must_derive(Method, SearchError, "search method")(name, kind)
    texts = {each: getattr(kind, each, None) for each in ("name", "summary")}
    lacking = [key for key, text in texts.items() if not isinstance(text, str) or not text.strip()]
    lacking += sorted(getattr(kind, "__abstractmethods__", ()))
    if lacking:
        raise SearchError(
            f"the search method '{name}' has no {' and no '.join(lacking)}",
            where=place_of_definition(kind),
            hint="Its class needs the texts name and summary, and the methods ask and tell",
        )


METHODS: Registry[type[Method]] = Registry(
    "search method",
    "optisense.methods",
    SearchError,
    {
        "grid": "optisense.search.methods._combinations:Grid",
        "random": "optisense.search.methods._random_search:Random",
        "cma-es": "optisense.search.methods._cma_es:CmaEs",
        "gradient": "optisense.search.methods.gradient:Gradient",
        "pareto": "optisense.search.methods._pareto:Pareto",
        "light-colours": "optisense.search.methods._lights:LightColours",
        "types": "optisense.search.methods._lights:LightTypes",
    },
    _check,
)

find, names = METHODS.find, METHODS.names


def register(method: type[Method]) -> type[Method]:
    """Add a method under its `name`; usable as a class decorator.

    Raises:
        SearchError: another method has this name, or the class is no complete method.
    """
    _check(getattr(method, "__name__", repr(method)), method)
    return METHODS.register(method.name, method)


def make(name: str, problem: Problem, options: dict[str, Any] | None = None) -> Method:
    """Return an instance of a method for a problem.

    Raises:
        SearchError: the name or an option is unknown, an option has the wrong type, the problem
            does not fit the method, or the constructor of another package's method fails.
    """
    kind = find(name)
    given = _typed_options(name, kind, options or {})
    try:
        return kind(problem, **given)
    except OptiSenseError:
        raise
    except Exception as error:
        if given and isinstance(error, TypeError | ValueError):
            raise SearchError(
                f"an option of {name} has the wrong type or value: {error}",
                hint="Check " + ", ".join(f"{key}={value}" for key, value in given.items()),
            ) from error
        if kind.name in METHODS.built_in:
            raise
        raise SearchError(
            f"the method {name} can't be set up: {type(error).__name__}: {error}",
            where=place_of(error),
            hint="The method must be repaired",
        ) from error


def _typed_options(name: str, kind: type[Method], options: dict[str, Any]) -> dict[str, Any]:
    """Return options in the types of the constructor's arguments; SearchError if one is invalid."""
    try:
        signature = inspect.signature(kind.__init__, eval_str=True)
    except Exception:  # a name of an annotation may be known to type checkers only
        signature = inspect.signature(kind.__init__)
    known = dict(list(signature.parameters.items())[2:])
    given = {}
    for key, value in options.items():
        if key not in known:
            hint = suggestion(key, known) or f"{name} takes no options"
            raise SearchError(f"{name} has no option '{key}'", hint=hint)
        try:
            given[key] = as_type(value, types_of(known[key]))
        except ValueError as wanted:
            raise SearchError(
                f"the option '{key}' of {name} is {value!r}", hint=f"Give {wanted}"
            ) from None
    return given
