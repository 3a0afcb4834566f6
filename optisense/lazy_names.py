"""Packages whose public names load on first use (PEP 562).

The import of such a package takes no longer than the names that are used.
"""

from __future__ import annotations

import ast
import sys
from collections.abc import Callable
from importlib import import_module
from pathlib import Path


def load_on_first_use(
    package: str, file: str, before: Callable[[], object] | None = None
) -> tuple[Callable[[str], object], Callable[[], list[str]]]:
    """Return a package's `__getattr__` and `__dir__`.

    Each name of `__all__` is imported from the module from which `if TYPE_CHECKING:` imports it for
    type checkers.

    Args:
        package: name of the package.
        file: path of its `__init__.py`.
        before: function that is called before each import.
    """
    tree = ast.parse(Path(file).read_text(encoding="utf-8"))
    homes = {
        name.name: statement.module
        for block in tree.body
        if isinstance(block, ast.If)
        for statement in block.body
        if isinstance(statement, ast.ImportFrom) and statement.module
        for name in statement.names
    }

    def get(name: str) -> object:
        if name not in homes:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        if before is not None:
            before()
        is_subpackage = homes[name] == package
        module = import_module(f"{package}.{name}" if is_subpackage else homes[name])
        value = module if is_subpackage else getattr(module, name)
        setattr(sys.modules[package], name, value)
        return value

    def names() -> list[str]:
        return sorted(sys.modules[package].__all__)

    return get, names
