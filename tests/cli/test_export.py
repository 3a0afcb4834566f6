"""`optisense export`: the files it writes, and what it refuses."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest
from step_extra import needs_step
from typer.testing import CliRunner

from optisense.cli import app
from optisense.cli.export import FORMATS
from optisense.geometry import TriangleMesh
from optisense.geometry.step import read_step
from optisense.workshop import FORMATS as WRITABLE


def run(*arguments: str) -> tuple[int, str]:
    """Exit code and everything that was printed."""
    result = CliRunner().invoke(app, ["export", *arguments])
    assert "Traceback" not in result.output
    return result.exit_code, result.output


def test_all_that_a_workshop_needs(tmp_path: Path) -> None:
    out = tmp_path / "new" / "workshop"
    code, text = run("gelsight-mini-ideal", "--out", str(out), "--format", "stl", "-f", "3MF")
    assert code == 0, text
    assert {file.name for file in out.iterdir()} == {
        "skin.stl", "gel.stl", "tray.stl", "guide.stl", "gelsight-mini-ideal.3mf",
        "tray-drawing.svg", "tray-cut.dxf", "guide-drawing.svg", "guide-cut.dxf",
        "pick-and-place.csv", "bill-of-materials.csv", "bill-of-materials.md",
        *(f"board-{board}{end}" for board in (1, 2, 3)
          for end in (".pos", "-cpl.csv", "-bom.csv", ".dxf")),
    }  # fmt: skip
    for file in out.iterdir():
        assert str(file) in text
    assert "not to be printed: skin" in text
    assert TriangleMesh.load(out / "guide.stl").volume == pytest.approx(25.25 * 20.75 * 4.0)


def test_a_model_for_robot_simulators(tmp_path: Path) -> None:
    code, text = run(
        "gelsight-mini-ideal", "--for", "URDF", "--density", "gel=0.97", "-o", str(tmp_path)
    )
    assert code == 0, text
    assert {path.name for path in tmp_path.iterdir()} == {"gelsight-mini-ideal.urdf", "meshes"}
    assert {path.stem for path in (tmp_path / "meshes").iterdir()} == {
        "skin", "gel", "tray", "guide", "gel-hull", "tray-hull", "guide-hull",
    }  # fmt: skip
    assert "gel 0.97" in text and "weighs" in text


def test_the_command_offers_what_can_be_written() -> None:
    assert FORMATS == WRITABLE


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (("gelsight-mini-ideal", "--format", "dxf"), "Known: 3mf, obj, step, stl"),
        (("gelsight-mini-ideal", "--format", "stlb"), "Did you mean 'stl'?"),
        (("gelsight-mini-ideal", "--format", "urdf"), "It is a robot format: write --for urdf"),
        (("gelsight-mini-ideal", "--for", "STL"), "It is a file format: write --format stl"),
        (("gelsight-minni",), "Did you mean 'gelsight-mini'?"),
        (("gelsight-mini-ideal", "--for", "gazebo"), "Known: mujoco, urdf"),
        (("gelsight-mini-ideal", "--for", "urdf", "--moulds"), "combined with --format"),
        (("gelsight-mini-ideal", "--mass", "20"), "needs --for"),
        (("gelsight-mini-ideal", "--for", "urdf", "--density", "gel"), "housing=1.24"),
        (("gelsight-mini-ideal", "--for", "urdf", "--density", "gell=1"), "gel, tray, guide"),
        (("gelsight-mini-ideal", "--for", "urdf", *2 * ("--density", "gel=1")), "given twice"),
        (("gelsight-mini-ideal", "--for", "urdf", "--mass", "-1"), "above 0"),
    ],
)
def test_bad_input_writes_nothing(
    tmp_path: Path, arguments: tuple[str, ...], complaint: str
) -> None:
    code, text = run(*arguments, "--out", str(tmp_path / "new"))
    assert code == 2
    assert complaint in text
    assert not (tmp_path / "new").exists()


def test_step_without_its_extra(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "OCP.STEPCAFControl", None)
    code, text = run("gelsight-mini-ideal", "--format", "step", "--out", str(tmp_path / "new"))
    assert code == 1
    assert "optisense[step]" in text
    assert not (tmp_path / "new").exists()


@needs_step
def test_folders_may_have_names_that_are_not_utf_8(tmp_path: Path) -> None:
    """As Linux allows them; other systems refuse to make the folder."""
    folder = tmp_path / os.fsdecode(b"caf\xe9")
    try:
        folder.mkdir()
    except OSError:
        pytest.skip("the file system takes only UTF-8")
    code, text = run("gelsight-mini-ideal", "--out", str(folder / "made"), "--format", "step")
    assert code == 0, text
    assert {body.name for body in read_step(folder / "made" / "gelsight-mini-ideal.step")} >= {
        "gel"
    }
    options = ["--photons", "20000", "--resolution", "40x30", "--out", str(folder / "picture")]
    result = CliRunner().invoke(app, ["render", "gelsight-mini-ideal", *options])
    assert result.exit_code == 0, result.output
    assert (folder / "picture" / "radiance.exr").read_bytes()[:4] == b"\x76\x2f\x31\x01"
