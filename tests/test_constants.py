"""Every numeric constant of a module says what it is."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path

from syntax_trees import FOLDERS, ROOT, statements, syntax_tree

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


CODES = {"Enum", "IntEnum", "IntFlag", "Flag"}
"""Base classes whose members are codes: their numbers have no unit and no reason."""


def test_numeric_constants_are_documented() -> None:
    assert list(undocumented(ROOT, *FOLDERS)) == []


def test_docstrings_of_numeric_constants_begin_with_the_number() -> None:
    assert list(headless(ROOT, *FOLDERS)) == []


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
        'TABLE = {"part": {"length": 2.0}}\nCOMPUTED = max(BARE, 4)\n'
        "class Thing:\n    SIZE = 2 * BARE\n    kind = 1\n"
        "class Kind(IntEnum):\n    FIRST = 1\n"
        "ITEM = NAME.split()[1]\nFOUND = lambda: 3\n"
        'ONE = 1\nTWO = 2\n"""Largest number of things, pieces."""\n'
    )
    assert list(undocumented(tmp_path, "package")) == [
        "package/module.py:1: BARE",
        "package/module.py:3: PAIR, OTHER",
        "package/module.py:5: TABLE",
        "package/module.py:6: COMPUTED",
        "package/module.py:14: ONE",
        "package/module.py:8: SIZE",
    ]


def undocumented(root: Path, *folders: str) -> Iterator[str]:
    """Place and name of each constant without a docstring of its own."""
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
    """Place and name, and docstring, of each numeric constant of modules and classes."""
    found = []
    for path in sorted(path for folder in folders for path in (root / folder).rglob("*.py")):
        for body in bodies(syntax_tree(path)):
            for number, node in enumerate(body):
                name = numeric_constant(node)
                if name is not None:
                    place = f"{path.relative_to(root)}:{node.lineno}: {name}"
                    found.append((place, docstring_after(body, number)))
    return found


def bodies(module: ast.Module) -> Iterator[list[ast.stmt]]:
    """The statements of a module, and of each class that does not define codes."""
    yield module.body
    for node in statements(module):
        match node:
            case ast.ClassDef(bases=bases) if not CODES & {ast.unparse(base) for base in bases}:
                yield node.body


def numeric_constant(node: ast.stmt) -> str | None:
    """The name that a statement gives to numbers, in capitals; None where it does not."""
    if isinstance(node, ast.Assign):
        target, value = node.targets[0], node.value
    elif isinstance(node, ast.AnnAssign) and node.value is not None:
        target, value = node.target, node.value
    else:
        return None
    if not has_number(value):
        return None
    name = ast.unparse(target).strip("()")
    return name if name.isupper() else None


def has_number(value: ast.AST) -> bool:
    """Whether an expression contains a number, other than in an index, a text or a function."""
    match value:
        case ast.Constant(value=number):
            return isinstance(number, int | float) and not isinstance(number, bool)
        case ast.Subscript(value=inner):
            return has_number(inner)
        case ast.Lambda() | ast.JoinedStr():
            return False
    return any(map(has_number, ast.iter_child_nodes(value)))


def docstring_after(body: Sequence[ast.stmt], number: int) -> str:
    """The docstring that follows a constant."""
    match body[number + 1 : number + 2]:
        case [ast.Expr(value=ast.Constant(value=str(text)))]:
            return text
    return ""
