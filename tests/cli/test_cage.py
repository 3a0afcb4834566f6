"""`optisense cage`: what it writes, and what it refuses."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import optisense
from optisense import sensors
from optisense.cli.app import app
from optisense.design import SensorDesign

runner = CliRunner()


def run(*words: object) -> tuple[int, str]:
    result = runner.invoke(app, ["cage", *map(str, words)])
    return result.exit_code, result.output


@pytest.fixture
def mini(tmp_path: Path) -> Path:
    folder = tmp_path / "mini"
    sensors.save_design(sensors.gelsight_mini_ideal(), folder)
    return folder


def test_moving_a_row_makes_the_papers_cylinder(mini: Path) -> None:
    assert run("move", mini, "skin", "--point", "1,*,2=0,0,6", "--out", mini)[0] == 0
    bent = optisense.load(mini).deformed_meshes()["skin"].vertices
    expected = sensors.gelsight_mini_ideal_cylindrical().deformed_meshes()["skin"].vertices
    np.testing.assert_allclose(bent, expected, atol=1e-12)


def test_add_range_blend_refine_and_show(tmp_path: Path) -> None:
    out = tmp_path / "new"
    assert run("add", "gelsight-svelte", "plate", "--part", "M2", "--out", out)[0] == 0
    assert run("range", out, "plate", "--max", "*,*,1=0.5,0,0", "--out", out)[0] == 0
    assert run("blend", out, "plate", "0.5", "--out", out)[0] == 0
    assert run("refine", out, "plate", "--resolution", "3x3x4", "--out", out)[0] == 0
    cage = optisense.load(out).cages["plate"]
    assert cage.blend == 0.5 and cage.resolution == (3, 3, 4)
    code, text = run("show", out, "plate")
    assert code == 0 and "3 x 3 x 4" in text and "c_max" in text
    assert "M1" in run("show", out)[1]


def test_a_folded_shape_is_refused_and_not_written(mini: Path) -> None:
    before = (mini / "design.yaml").read_text()
    code, text = run("move", mini, "skin", "--point", "1,1,2=0,0,-12", "--out", mini)
    assert code == 2 and "inside out" in text
    assert (mini / "design.yaml").read_text() == before


def test_another_folder_that_is_in_use_is_refused(mini: Path, tmp_path: Path) -> None:
    other = tmp_path / "other"
    other.mkdir()
    (other / "notes.txt").write_text("mine")
    code, text = run("move", mini, "skin", "--point", "13=0,0,0.1", "--out", other)
    assert code == 1 and "not empty" in text
    assert [path.name for path in other.iterdir()] == ["notes.txt"]


def test_a_change_made_while_the_command_runs_is_not_lost(
    mini: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = mini / "design.yaml"

    def read_and_edit(name: str) -> SensorDesign:
        design = optisense.load(name)
        file.write_text(file.read_text() + "dispersion: false\n")
        return design

    monkeypatch.setattr(sensors, "load", read_and_edit)
    code, text = run("move", mini, "skin", "--point", "13=0,0,0.1", "--out", mini)
    assert code == 1 and "changed on disk" in text and "Repeat the command" in text
    assert optisense.load(mini).dispersion is False


@pytest.mark.parametrize("point", ["x=1", "1,1,1", "1,1,1=2", "=1,2,3,4"])
def test_a_point_that_cannot_be_read(mini: Path, point: str) -> None:
    assert run("move", mini, "skin", "--point", point, "--out", mini)[0] == 2
