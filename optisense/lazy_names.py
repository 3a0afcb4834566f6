"""Packages whose public names load on first use (PEP 562).

The import of such a package takes no longer than the names that are used.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from importlib import import_module


def load_on_first_use(
    package: str, homes: Mapping[str, str], before: Callable[[], object] | None = None
) -> tuple[Callable[[str], object], Callable[[], list[str]]]:
    """Return a package's `__getattr__` and `__dir__`.

    For type checkers the package imports the same names under `TYPE_CHECKING`.

    Args:
        homes: module of each public name, relative to the package (`".model"`); if the module has
            the same name as the public name, the name stands for the module.
        before: function that is called before each import.
    """

    def get(name: str) -> object:
        if name not in homes:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        if before is not None:
            before()
        module = import_module(homes[name], package)
        value = module if homes[name] == f".{name}" else getattr(module, name)
        setattr(sys.modules[package], name, value)
        return value

    def names() -> list[str]:
        return sorted(sys.modules[package].__all__)

    return get, names
