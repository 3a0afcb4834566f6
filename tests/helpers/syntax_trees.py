"""Syntax trees of Python files, which several tests read."""

from __future__ import annotations

import ast
import gc
from collections.abc import Iterator
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[2]
FOLDERS = ("optisense", "paper", "studio", "benchmarks", "scripts", "examples")
"""Folders of the repository whose files tests read."""


def syntax_tree(path: Path) -> ast.Module:
    """Return the tree of a file. Those of the repository are parsed once."""
    tree = trees().get(path)
    return ast.parse(path.read_text(encoding="utf-8")) if tree is None else tree


@cache
def trees() -> dict[Path, ast.Module]:
    """The trees of all files of the repository, which the garbage collector leaves out: it would
    take twice as long to look through them, again and again, as they take to parse.
    """
    gc.collect()
    gc.disable()
    try:
        found = [path for folder in FOLDERS for path in (ROOT / folder).rglob("*.py")]
        return {path: ast.parse(path.read_text(encoding="utf-8")) for path in found}
    finally:
        gc.freeze()
        gc.enable()


def inner(node: ast.AST) -> Iterator[ast.stmt]:
    """Yield the statements directly in a module or a statement."""
    for field in ("body", "handlers", "orelse", "finalbody", "cases"):
        for child in getattr(node, field, ()):
            if isinstance(child, ast.stmt):
                yield child
            else:
                yield from inner(child)


def statements(node: ast.AST) -> Iterator[ast.stmt]:
    """Yield the statements in a module or a statement, however deep.

    This takes a tenth of the time of `ast.walk`, which yields the expressions, too.
    """
    for child in inner(node):
        yield child
        yield from statements(child)
