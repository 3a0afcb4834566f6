"""A name means one thing: in the whole package, and a private name only in its own module."""

from __future__ import annotations

import ast
from collections import defaultdict
from collections.abc import Iterator

import pytest
from syntax_trees import ROOT, statements, syntax_tree


def modules(*folders: str) -> Iterator[tuple[str, ast.Module]]:
    """Path and syntax tree of each Python file."""
    for path in sorted(path for folder in folders for path in (ROOT / folder).rglob("*.py")):
        yield str(path.relative_to(ROOT)), syntax_tree(path)


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
    """A private module may be imported within its own package only, and a private name nowhere."""
    found = []
    for path, tree in modules("optisense", "paper", "studio"):
        own = path.rsplit("/", 1)[0]
        for node in statements(tree):
            if not isinstance(node, ast.ImportFrom):
                continue
            folder = (node.module or "").replace(".", "/")
            for name in node.names:
                private = [part for part in (*folder.split("/"), name.name) if is_private(part)]
                inside = folder.partition("/_")[0]
                is_module = (ROOT / inside / f"{private[0]}.py").is_file() if private else False
                if private and not (is_module and f"{own}/".startswith(f"{inside}/")):
                    found.append(f"{path}:{node.lineno}: {name.name} of {node.module}")
    assert found == []


def test_a_module_that_only_its_package_uses_is_private() -> None:
    """Its name begins with an underscore, unless the documentation names it for users.

    `cli` and `engine` are programs, which nothing imports; the modules beside the packages are the
    base of all of them.
    """
    documentation = "".join(
        (ROOT / "docs" / page).read_text(encoding="utf-8") for page in ("api.md", "extending.md")
    )
    users: dict[str, set[str]] = defaultdict(set)
    for path, tree in modules("optisense", "paper", "studio", "benchmarks"):
        for name in imported(tree):
            users[name].add(path.rpartition("/")[0] + "/")
    found = []
    for path, _ in modules("optisense"):
        folder, _, file = path.rpartition("/")
        if folder in ("optisense", "optisense/cli", "optisense/engine") or file.startswith("_"):
            continue
        if file == "base.py" and folder.startswith("optisense/design/"):
            continue  # docs/extending.md names these files by their folder
        name = path.removesuffix(".py").replace("/", ".")
        if name not in documentation and all(
            user.startswith(f"{folder}/") for user in users.get(name, ())
        ):
            found.append(path)
    assert found == []


def imported(tree: ast.Module) -> set[str]:
    """Dotted names of all modules, and of all names in them, that a module imports or names."""
    found = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module:
            found |= {node.module, *(f"{node.module}.{name.name}" for name in node.names)}
        elif isinstance(node, ast.Import):
            found |= {name.name for name in node.names}
        elif isinstance(node, ast.Constant) and str(node.value).startswith("optisense."):
            found.add(str(node.value))
    return found


def is_private(name: str) -> bool:
    return name.startswith("_") and not name.startswith("__")
