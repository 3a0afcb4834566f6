"""Rows of the objects of a registry, for requests that list them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

from optisense.errors import OptiSenseError
from optisense.own_code import error_of_own_code
from optisense.registry import Registry

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
