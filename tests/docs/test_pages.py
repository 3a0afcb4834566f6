"""Files, make targets and public names that the documents refer to exist."""

from __future__ import annotations

import importlib
import re
from pathlib import Path

from .markdown import blocks

ROOT = Path(__file__).parents[2]
PAGES = [
    *(ROOT / name for name in ("README.md", "CONTRIBUTING.md", "SECURITY.md")),
    *sorted((ROOT / "docs").glob("*.md")),
]


def test_links_lead_somewhere() -> None:
    links = [
        (page, target)
        for page in PAGES
        for target in re.findall(r"\]\(([^)#\s]+)[^)]*\)", page.read_text(encoding="utf-8"))
        if not re.match(r"[a-z]+:", target)
    ]
    assert len(links) > 100
    assert [
        (page.name, target) for page, target in links if not (page.parent / target).exists()
    ] == []


def test_make_targets_exist() -> None:
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    targets = {
        target
        for page in PAGES
        for block in blocks(page)
        for target in re.findall(r"^\$ make ([a-z-]+)", block.text, re.MULTILINE)
    }
    assert {"demo", "test"} <= targets
    assert {
        each for each in targets if not re.search(rf"^{each}:", makefile, re.MULTILINE)
    } == set()


def test_the_reference_lists_every_public_name() -> None:
    text = (ROOT / "docs" / "api.md").read_text(encoding="utf-8")
    packages = re.findall(r"^\.\. automodule:: (\S+)$", text, re.MULTILINE)
    assert len(packages) > 8
    for package in packages:  # the site shows what `dir` tells, also of names imported on first use
        module = importlib.import_module(package)
        assert set(getattr(module, "__all__", [])) <= set(dir(module)), package


def test_documents_and_examples_import_public_modules_only() -> None:
    """`docs/api.md` says which modules are public; nobody is shown another one."""
    text = (ROOT / "docs" / "api.md").read_text(encoding="utf-8")
    public = set(re.findall(r"^\.\. automodule:: (\S+)$", text, re.MULTILINE))
    public |= set(re.findall(r"^\| `(optisense\.\S+)` \|", text, re.MULTILINE))
    assert len(public) > 20
    code = [
        (page, block.text) for page in PAGES for block in blocks(page) if block.language == "python"
    ]
    code += [(file, file.read_text("utf-8")) for file in (ROOT / "examples").glob("*.py")]
    imported = [
        (page.name, module)
        for page, text in code
        for module in re.findall(r"^\s*(?:from|import) (optisense\.[\w.]+)", text, re.MULTILINE)
    ]
    assert len(imported) > 20
    assert [each for each in imported if each[1] not in public] == []
    for module in public:
        importlib.import_module(module)
