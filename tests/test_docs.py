"""What the documents show works: Python examples run, commands parse, links lead somewhere."""

from __future__ import annotations

import importlib
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from optisense.cli import app

ROOT = Path(__file__).parent.parent
PAGES = sorted([*(ROOT / "docs").glob("*.md"), ROOT / "README.md"])

PAGE = pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)


def blocks(page: Path, language: str) -> list[str]:
    """The fenced blocks of a language."""
    text = page.read_text(encoding="utf-8")
    return re.findall(rf"^```{language}\n(.*?)^```", text, re.DOTALL | re.MULTILINE)


@PAGE
def test_python_examples_run(page: Path, tmp_path: Path) -> None:
    """Each page's examples run in order, in one process, as a reader would paste them."""
    examples = blocks(page, "python")
    if not examples:
        pytest.skip("no Python on this page")
    (tmp_path / "docs").symlink_to(ROOT / "docs")  # as in the project's folder, but to write in
    (tmp_path / "example.py").write_text("\n".join(examples), encoding="utf-8")
    child = subprocess.run(
        [sys.executable, "example.py"], cwd=tmp_path, capture_output=True, text=True
    )
    assert child.returncode == 0, child.stderr


@PAGE
def test_commands_exist_with_their_options(page: Path) -> None:
    for block in blocks(page, "console"):
        for line in block.splitlines():
            if line.startswith("$ optisense "):
                words = shlex.split(line.removeprefix("$ optisense "), comments=True)
                result = CliRunner().invoke(app, [*words, "--help"])
                assert result.exit_code == 0, f"{line}\n{result.output}"


@PAGE
def test_links_lead_somewhere(page: Path) -> None:
    for target in re.findall(r"\]\(([^)#\s]+)[^)]*\)", page.read_text(encoding="utf-8")):
        if not re.match(r"[a-z]+:", target):
            assert (page.parent / target).exists(), target


@PAGE
def test_make_targets_exist(page: Path) -> None:
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    for block in blocks(page, "console"):
        for target in re.findall(r"^\$ make ([a-z-]+)", block, re.MULTILINE):
            assert re.search(rf"^{target}:", makefile, re.MULTILINE), target


def test_the_reference_lists_every_public_name() -> None:
    text = (ROOT / "docs" / "api.md").read_text(encoding="utf-8")
    packages = re.findall(r"^\.\. automodule:: (\S+)$", text, re.MULTILINE)
    assert len(packages) > 8
    for package in packages:  # the site shows what `dir` tells, also of names imported on first use
        module = importlib.import_module(package)
        assert set(getattr(module, "__all__", [])) <= set(dir(module)), package
