"""Syntax trees of Python files, which several tests read."""

from __future__ import annotations

import ast
from functools import cache
from pathlib import Path


@cache
def syntax_tree(path: Path) -> ast.Module:
    """Return the tree of a file, which is parsed once."""
    return ast.parse(path.read_text(encoding="utf-8"))
