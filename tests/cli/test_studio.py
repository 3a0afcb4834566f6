"""`optisense studio`: the extension's zip, finding Blender, installing, starting."""

from __future__ import annotations

import sys
import tomllib
import zipfile
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from optisense.cli import app, studio_extension

ROOT = Path(__file__).parents[2]

FAKE = """#!/bin/sh
echo "$@" >> "{log}"
echo "engine=$OPTISENSE_ENGINE open=$OPTISENSE_OPEN" >> "{log}"
[ "$1" = --version ] && echo "Blender {version}"
exit {code}
"""


def run(*arguments: str) -> Result:
    return CliRunner().invoke(app, ["studio", *arguments])


def fake_blender(folder: Path, version: str = "4.5.3 LTS", code: int = 0) -> Path:
    program = folder / "blender"
    program.write_text(FAKE.format(log=folder / "log", version=version, code=code))
    program.chmod(0o755)
    return program


@pytest.fixture
def nowhere(monkeypatch: pytest.MonkeyPatch) -> None:
    """No Blender on the search path or in a usual place."""
    monkeypatch.setattr(studio_extension, "PLACES", {})
    monkeypatch.setenv("PATH", "")


def test_the_zip_holds_the_extension_and_nothing_else(tmp_path: Path) -> None:
    archive = tmp_path / "out" / "extension.zip"
    assert run("--zip", str(archive)).exit_code == 0
    names = set(zipfile.ZipFile(archive).namelist())
    assert {"blender_manifest.toml", "__init__.py", "core/engine.py"} <= names
    sources = {p.relative_to(ROOT / "studio").as_posix() for p in (ROOT / "studio").rglob("*.py")}
    pages = {f"help/{name}.md" for name in studio_extension.HELP}
    assert names == sources | {"blender_manifest.toml"} | pages
    assert archive.stat().st_size < 300_000
    for each in pages:
        page = zipfile.ZipFile(archive).read(each)
        assert page == (ROOT / "docs" / Path(each).name).read_bytes()
    first = archive.read_bytes()
    run("--zip", str(archive))
    assert archive.read_bytes() == first


def test_the_wheel_brings_the_help() -> None:
    wheel = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["hatch"]["build"]
    brought = wheel["targets"]["wheel"]["shared-data"]
    for name in studio_extension.HELP:
        assert brought[f"docs/{name}.md"] == f"share/optisense/docs/{name}.md"


def test_the_manifest_is_what_blender_asks_for() -> None:
    manifest = tomllib.loads((ROOT / "studio" / "blender_manifest.toml").read_text())
    assert len(manifest["tagline"]) <= 64 and not manifest["tagline"].endswith(".")
    assert manifest["blender_version_min"] == "4.2.0"
    assert manifest["license"] == ["SPDX:Apache-2.0"]
    assert all(len(reason) <= 64 for reason in manifest["permissions"].values())


def test_the_extension_imports_only_what_blender_has() -> None:
    import ast

    of_blender = {"bpy", "bpy_extras", "blf", "bmesh", "gpu", "gpu_extras", "mathutils", "numpy"}
    allowed = {*sys.stdlib_module_names, *of_blender}
    for path in (ROOT / "studio").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = []
            if isinstance(node, ast.Import):
                names = [alias.name for alias in node.names]
            elif isinstance(node, ast.ImportFrom) and node.level == 0:
                names = [node.module or ""]
            assert {name.partition(".")[0] for name in names} <= allowed, path


def test_without_blender_it_says_how_to_get_one(nowhere: None) -> None:
    result = run()
    assert result.exit_code == 1
    assert "no Blender was found" in result.output
    assert "blender.org/download" in result.output


def test_installs_and_starts_the_blender_on_the_path(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    fake_blender(tmp_path)
    monkeypatch.setenv("PATH", f"{tmp_path}:/usr/bin:/bin")
    result = run("gelsight-mini-ideal")
    assert result.exit_code == 0, result.output
    log = (tmp_path / "log").read_text()
    assert "--command extension install-file -r user_default --enable" in log
    assert "-m optisense.cli engine open=gelsight-mini-ideal" in log
    (tmp_path / "log").unlink()
    assert run("--no-start").exit_code == 0
    assert "open=gelsight-mini-ideal" not in (tmp_path / "log").read_text()


def test_an_old_blender_a_broken_one_and_no_blender_are_told(tmp_path: Path) -> None:
    old = fake_blender(tmp_path, "3.6.1")
    result = run("--blender", str(old))
    assert result.exit_code == 1 and "3.6 is too old" in result.output
    refusing = fake_blender(tmp_path, code=1)
    result = run("--blender", str(refusing))
    assert result.exit_code == 1 and "Install from Disk" in result.output
    result = run("--blender", str(tmp_path / "nothing"))
    assert result.exit_code == 1 and "is no program" in result.output
    result = run("--blender", sys.executable)
    assert result.exit_code == 1 and "this program is no Blender" in result.output


def test_an_unknown_design_is_told_before_blender_starts(tmp_path: Path) -> None:
    program = fake_blender(tmp_path)
    result = run("gelsight-mimi", "--blender", str(program))
    assert result.exit_code == 2 and "gelsight-mini" in result.output
    assert not (tmp_path / "log").exists()
