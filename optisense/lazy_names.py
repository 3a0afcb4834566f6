"""Packages whose public names load on first use (PEP 562).

Whoever imports such a package waits for nothing that he does not ask for.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from importlib import import_module


def load_on_first_use(
    package: str, homes: Mapping[str, str], before: Callable[[], object] | None = None
) -> tuple[Callable[[str], object], Callable[[], list[str]]]:
    """A package's `__getattr__` and `__dir__`.

    For type checkers the package imports the same names under `TYPE_CHECKING`.

    Args:
        package: its name.
        homes: the module of each public name, relative to the package (`".model"`); one that is
            called as the name itself is what the name stands for.
        before: called ahead of each import.
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
