"""Links in a design's folder: to themselves, in circles, and out of it."""

from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner

import optisense as ots
from optisense.cli import app
from optisense.design import save_design
from optisense.errors import DesignError, OptiSenseError, OutputError


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    save_design(ots.load("gelsight-mini-ideal"), tmp_path / "design")
    return tmp_path / "design"


@pytest.mark.parametrize("way", ["itself", "circle", "folder"])
def test_a_link_to_itself_is_no_file(way: str, folder: Path) -> None:
    mesh = folder / "meshes" / "gel.obj"
    mesh.unlink()
    if way == "itself":
        mesh.symlink_to(mesh)
    elif way == "circle":
        mesh.symlink_to(folder / "meshes" / "other.obj")
        (folder / "meshes" / "other.obj").symlink_to(mesh)
    else:
        for each in (folder / "meshes").iterdir():
            each.unlink()
        (folder / "meshes").rmdir()
        (folder / "meshes").symlink_to(folder / "meshes")
    with pytest.raises(DesignError, match="no file"):
        ots.load(folder)
    result = CliRunner().invoke(app, ["check", str(folder)])
    assert result.exit_code == 2
    assert "unexpected" not in result.output


def test_a_design_that_is_a_link_to_itself_is_told(tmp_path: Path) -> None:
    loop = tmp_path / "loop"
    loop.symlink_to(loop)
    for name in (loop, loop / "design.yaml"):
        with pytest.raises(OptiSenseError):
            ots.load(name)
    for words in (["new", "gelsight-mini-ideal", loop],
                  ["render", "gelsight-mini-ideal", "--out", loop],
                  ["check", loop], ["apply", loop, "--out", tmp_path / "x"],
                  ["search", "gelsight-mini-ideal", "--vary", "camera.fov=40:60",
                   "-b", f"{loop}.py:f", "--rule", f"{loop}/a.py:f",
                   "--out", tmp_path / "y"]):  # fmt: skip
        result = CliRunner().invoke(app, [str(word) for word in words])
        assert result.exit_code in (1, 2), words
        assert "unexpected" not in result.output, result.output


def test_a_link_out_of_the_folder_is_not_written_through(folder: Path, tmp_path: Path) -> None:
    outside = tmp_path / "outside"
    (folder / "meshes").rename(outside)
    (folder / "meshes").symlink_to(outside)
    before = {path: path.stat().st_mtime_ns for path in outside.iterdir()}
    with pytest.raises(OutputError, match="through a link"):
        save_design(ots.load("gelsight-mini-ideal"), folder)
    assert {path: path.stat().st_mtime_ns for path in outside.iterdir()} == before
