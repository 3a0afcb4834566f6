"""What the commands print, write and exit with."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import click
import pytest
import typer
from typer.testing import CliRunner

import optisense
from optisense.cli import app
from optisense.cli.commands import Commands
from optisense.sensors import SENSORS

runner = CliRunner()

OTHER_SENSOR = "gelsight-mini-ideal-cylindrical"
"""A sensor in whose report no ball is pressed: beside a picture of GelSight Mini, one is, as it was
into the real sensor."""


def run(*arguments: str) -> tuple[int, str]:
    """Exit code and everything that was printed."""
    result = runner.invoke(app, list(arguments))
    assert "Traceback" not in result.output
    return result.exit_code, result.output


def test_version() -> None:
    assert run("--version") == (0, f"optisense {optisense.__version__}\n")


@pytest.mark.parametrize("command", list(Commands().commands))
def test_each_command_explains_itself(command: str) -> None:
    """In lines as long as the terminal allows, whatever the lines of the docstring."""
    result = runner.invoke(app, [command, "--help"], env={"COLUMNS": "80"}, terminal_width=80)
    assert result.exit_code == 0
    usage, text = result.output.split("[OPTIONS]" if "[OPTIONS]" in result.output else "Usage", 1)
    lines = [line.strip() for line in text.split("╭")[0].splitlines()[1:]]
    assert any(lines), usage
    for line, following in pairwise(lines):
        first, _, _ = following.partition(" ")
        assert not first or not line or len(f" {line} {first}") > 78, line


def options(command: Any, name: str = "optisense") -> Iterator[tuple[str, str]]:
    """The name and the help text of each option and argument of a command and those below it."""
    for parameter in command.params:
        yield f"{name} {parameter.name}", getattr(parameter, "help", None) or ""
    if hasattr(command, "list_commands"):
        context = click.Context(command)
        for below in command.list_commands(context):
            yield from options(command.get_command(context, below), f"{name} {below}")


def test_each_help_text_is_whole() -> None:
    """A text that ends within a sentence has lost a line."""
    texts = dict(options(typer.main.get_command(app)))
    assert len(texts) > 200
    cut = [name for name, text in texts.items() if not text.strip().endswith((".", "?", ")", "]"))]
    assert not cut


HEAVY = {"mitsuba", "drjit", "numpy", "scipy", "trimesh", "matplotlib"}
FOR_OTHERS = {"cma", "dask", "matplotlib", "sklearn", "trimesh", "optisense.search"}
COMMANDS = {f"optisense.cli.{name}" for name in ("check", "search", "studio", "library", "task")}


@pytest.mark.parametrize(
    ("arguments", "needless"),
    [
        (["render", "--help"], HEAVY | COMMANDS),
        (["evaluate", "--help"], HEAVY | COMMANDS),
        (
            ["check", "gelsight-mini-ideal"],
            FOR_OTHERS | {"drjit", "mitsuba", "scipy.optimize", "jinja2"},
        ),
        (
            ["render", OTHER_SENSOR, "--resolution=40x30", "--photons=20000", "--out=here"],
            FOR_OTHERS
            | {"scipy.optimize", "scipy.stats", "optisense.objectives", "optisense.report.scores"},
        ),
    ],
)
def test_a_command_loads_only_what_it_needs(
    arguments: list[str], needless: set[str], tmp_path: Path
) -> None:
    """Neither other commands, nor the renderer or NumPy for its help."""
    script = (
        "import sys\n"
        "from typer.testing import CliRunner\n"
        "from optisense.cli import app\n"
        f"result = CliRunner().invoke(app, {arguments!r})\n"
        "assert result.exit_code == 0, result.output\n"
        f"print(sorted({needless!r} & set(sys.modules)))\n"
    )
    child = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, cwd=tmp_path
    )
    assert child.stdout.strip() == "[]", child.stderr


def test_a_misspelt_command_gets_the_near_match() -> None:
    code, text = run("rendr")
    assert code == 2
    assert "'render'" in text


@pytest.mark.parametrize("name", SENSORS.names())
def test_a_new_design_passes_the_check(name: str, tmp_path: Path) -> None:
    folder = tmp_path / "mine"
    assert run("new", name, str(folder))[0] == 0
    code, text = run("check", str(folder))
    assert code == 0, text
    assert "in order" in text
    assert name in text


def test_new_keeps_off_folders_with_something_in_them(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("mine")
    code, text = run("new", "gelsight-mini-ideal", str(tmp_path))
    assert code != 0
    assert "not empty" in text
    assert [path.name for path in tmp_path.iterdir()] == ["notes.txt"]


def test_a_misspelt_sensor_gets_the_near_match(tmp_path: Path) -> None:
    code, text = run("new", "gelsight-minni", str(tmp_path / "new"))
    assert code == 2
    assert "Did you mean 'gelsight-mini'?" in text
    assert not (tmp_path / "new").exists()


def test_a_misspelt_field_is_told_with_file_and_line(tmp_path: Path) -> None:
    run("new", "gelsight-mini-ideal", str(tmp_path / "mine"))
    file = tmp_path / "mine" / "design.yaml"
    lines = file.read_text().splitlines()
    place = next(i for i, line in enumerate(lines) if line.strip().startswith("fov:"))
    lines[place] = lines[place].replace("fov:", "fow:")
    file.write_text("\n".join(lines))
    code, text = run("check", str(tmp_path / "mine"))
    assert code == 2
    assert f"design.yaml:{place + 1}" in text
    assert "fov" in text


def test_a_loose_gel_can_be_pressed_with_the_conforming_skin(tmp_path: Path) -> None:
    design = optisense.load("gelsight-mini-ideal")
    for name in set(design.parts) - {"gel", "skin"}:
        del design.parts[name], design.meshes[name]
    optisense.save_design(design, tmp_path / "loose")
    code, text = run("check", str(tmp_path / "loose"))
    assert code == 0, text
    assert "the gel touches no rigid part" in text and "--skin conforming" in text


@pytest.mark.parametrize(
    ("contact", "complaint"),
    [
        ("spere:1@0,0:1", "sphere"),
        ("sphere:1.5@0,0:20", "deep"),
        ("sphere:1.5@90,0:0.5", "off the sensing surface"),
        ("sphere", "@"),
    ],
)
def test_a_contact_that_does_not_fit_is_bad_input(contact: str, complaint: str) -> None:
    code, text = run("check", "gelsight-mini-ideal", "--contact", contact)
    assert code == 2
    assert complaint in text


def test_contacts_that_the_skin_can_not_take_are_bad_input() -> None:
    contacts = ("--contact", "sphere:1.5@0,0:0.5", "--contact", "sphere:1.5@1,0:0.5")
    code, text = run("check", "gelsight-mini-ideal", *contacts)
    assert code == 2
    assert "two contacts overlap" in text


def test_a_contact_that_fits_passes() -> None:
    code, text = run("check", "gelsight-mini-ideal", "--contact", "sphere:1.5@2,1:0.8")
    assert code == 0, text
    assert "1 contact fits" in text


def test_the_library_lists_and_shows_with_sources() -> None:
    code, text = run("library", "list", "light")
    assert code == 0
    assert "smd-3528" in text
    code, text = run("library", "show", "smd-3528")
    assert code == 0
    assert "2.4" in text
    assert "assumed" in text


@pytest.mark.parametrize("arguments", [("list", "lamps"), ("show", "acrilic")])
def test_unknown_library_words_are_bad_input(arguments: tuple[str, ...]) -> None:
    assert run("library", *arguments)[0] == 2


def test_the_doctor_finds_this_machine_well() -> None:
    code, text = run("doctor")
    assert code == 0, text
    assert "libLLVM" in text
    assert "Everything needed is here" in text


def test_the_doctor_says_what_to_do_about_a_bad_libllvm(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    (tmp_path / "libLLVM-15.so").write_text("")
    monkeypatch.setenv("DRJIT_LIBLLVM_PATH", str(tmp_path / "libLLVM-15.so"))
    code, text = run("doctor")
    assert code == 1
    assert "too old" in text
