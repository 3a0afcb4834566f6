"""Every numeric constant of a module says what it is."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[1]
LEAST_WORDS = 5
"""A docstring of fewer words names no meaning, unit and reason."""

HEADLESS = (
    "And",
    "As",
    "By",
    "For",
    "From",
    "How",
    "Of",
    "So",
    "That",
    "What",
    "Where",
    "Whose",
    "With",
)
"""First words of docstrings that do not name the number."""


def test_numeric_constants_are_documented() -> None:
    found = list(undocumented(ROOT, "optisense", "paper", "studio"))
    assert found == []


def test_docstrings_of_numeric_constants_begin_with_the_number() -> None:
    assert list(headless(ROOT, "optisense", "paper", "studio")) == []


def test_docstrings_without_a_subject_are_found(tmp_path: Path) -> None:
    folder = tmp_path / "package"
    folder.mkdir()
    (folder / "module.py").write_text(
        'BAD = 3\n"""Of a pixel in contacts, for that."""\n'
        'GOOD = 1\n"""Offset of a pixel in contacts, mm."""\n'
    )
    assert list(headless(tmp_path, "package")) == ["package/module.py:1: BAD"]


def test_the_check_finds_what_it_looks_for(tmp_path: Path) -> None:
    folder = tmp_path / "package"
    folder.mkdir()
    (folder / "module.py").write_text(
        'BARE = 3\n"""mm."""\nPAIR, OTHER = 1.0, -2.0\nNAME = "text"\n'
        'ONE = 1\nTWO = 2\n"""Smallest and largest number of things."""\n'
    )
    assert list(undocumented(tmp_path, "package")) == [
        "package/module.py:1: BARE",
        "package/module.py:3: PAIR, OTHER",
    ]


def undocumented(root: Path, *folders: str) -> Iterator[str]:
    """Place and name of each constant without a docstring; constants one below another may share
    the one that follows them.
    """
    for place, text in constants(root, *folders):
        if len(text.split()) < LEAST_WORDS:
            yield place


def headless(root: Path, *folders: str) -> Iterator[str]:
    """Place and name of each constant whose docstring begins without a subject."""
    for place, text in constants(root, *folders):
        if text.split()[:1] and text.split()[0] in HEADLESS:
            yield place


@cache
def constants(root: Path, *folders: str) -> list[tuple[str, str]]:
    """Place and name, and docstring, of each numeric constant."""
    found = []
    for path in sorted(path for folder in folders for path in (root / folder).rglob("*.py")):
        body = ast.parse(path.read_text(encoding="utf-8")).body
        for number, node in enumerate(body):
            name = numeric_constant(node)
            if name is not None:
                place = f"{path.relative_to(root)}:{node.lineno}: {name}"
                found.append((place, docstring_after(body, number)))
    return found


def numeric_constant(node: ast.stmt) -> str | None:
    """The name that a statement gives to numbers, in capitals; None where it does not."""
    if isinstance(node, ast.Assign):
        target, value = node.targets[0], node.value
    elif isinstance(node, ast.AnnAssign) and node.value is not None:
        target, value = node.target, node.value
    else:
        return None
    name = ast.unparse(target).strip("()")
    return name if name.isupper() and is_numeric(value) else None


def is_numeric(value: ast.expr) -> bool:
    match value:
        case ast.Constant(value=bool()):
            return False
        case ast.Constant(value=int() | float()):
            return True
        case ast.Tuple(elts=parts) | ast.List(elts=parts):
            return bool(parts) and all(map(is_numeric, parts))
        case ast.BinOp(left=left, right=right):
            return is_numeric(left) and is_numeric(right)
        case ast.UnaryOp(operand=operand):
            return is_numeric(operand)
    return False


def docstring_after(body: Sequence[ast.stmt], number: int) -> str:
    """The docstring that follows a constant, or the constants directly below it."""
    for node in body[number + 1 :]:
        match node:
            case ast.Expr(value=ast.Constant(value=str(text))):
                return text
        if numeric_constant(node) is None:
            return ""
    return ""
