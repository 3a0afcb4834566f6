"""A name means one thing: in the whole package, and a private name only in its own module."""

from __future__ import annotations

import ast
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


def modules(*folders: str) -> Iterator[tuple[str, ast.Module]]:
    """Path and syntax tree of each Python file."""
    for path in sorted(path for folder in folders for path in (ROOT / folder).rglob("*.py")):
        yield str(path.relative_to(ROOT)), ast.parse(path.read_text(encoding="utf-8"))


@pytest.mark.parametrize("package", ["optisense", "paper"])
def test_a_public_class_name_is_defined_once(package: str) -> None:
    homes: dict[str, list[str]] = defaultdict(list)
    for path, tree in modules(package):
        for node in tree.body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                homes[node.name].append(path)
    assert homes
    assert {name: where for name, where in homes.items() if len(where) > 1} == {}


def test_no_module_imports_a_private_name_of_another() -> None:
    found = [
        f"{path}:{node.lineno}: {name.name} of {node.module}"
        for path, tree in modules("optisense", "paper", "studio")
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom)
        for name in node.names
        if name.name.startswith("_") and not name.name.startswith("__")
    ]
    assert found == []
