"""Folders into which commands do not write: those of designs, and those with files of the user."""

from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner

from optisense.cli import app

MINI = "gelsight-mini-ideal"
COMMANDS = {
    "image.png": ("render", MINI, "--resolution", "40x30", "--photons", "20000"),
    "scores.json": ("evaluate", MINI, "--objective", "coverage"),
    "verify.json": ("verify", MINI, "gelsight-mini", "--quick"),
    "tray.stl": ("export", MINI),
    "gelsight-mini-ideal.urdf": ("export", MINI, "--for", "urdf"),
}
"""Commands that write folders, by one of their files."""


def run(file: str, out: Path) -> tuple[int, str]:
    result = CliRunner().invoke(app, [*COMMANDS[file], "--out", str(out)])
    return result.exit_code, "".join(result.output.split())


@pytest.mark.parametrize("file", COMMANDS)
def test_a_file_of_the_user_is_not_replaced(file: str, tmp_path: Path) -> None:
    (tmp_path / file).write_text("mine")
    code, said = run(file, tmp_path)
    assert code != 0
    assert "thefileexistsalready" in said and file in said
    assert [each.name for each in tmp_path.iterdir()] == [file]
    assert (tmp_path / file).read_text() == "mine"


@pytest.mark.parametrize("file", COMMANDS)
def test_the_folder_of_a_design_is_refused(file: str, tmp_path: Path) -> None:
    (tmp_path / "design.yaml").write_text("mine")
    code, said = run(file, tmp_path)
    assert code != 0
    assert "thisisthefolderofadesign" in said
    assert [each.name for each in tmp_path.iterdir()] == ["design.yaml"]


@pytest.mark.parametrize("file", [each for each in COMMANDS if each != "verify.json"])
def test_earlier_results_are_replaced(file: str, tmp_path: Path) -> None:
    out = tmp_path / "out"
    for _ in range(2):
        code, said = run(file, out)
        assert code == 0, said
        assert (out / file).exists()


@pytest.mark.parametrize(
    "command", [*COMMANDS.values(), ("task", "misalignment", MINI)], ids=" ".join
)
def test_a_file_is_no_folder(command: tuple[str, ...], tmp_path: Path) -> None:
    file = tmp_path / "notes.txt"
    file.write_text("mine")
    result = CliRunner().invoke(app, [*command, "--out", str(file)])
    assert result.exit_code == 1
    assert "is a file" in result.output
    assert file.read_text() == "mine"
