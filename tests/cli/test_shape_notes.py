"""Pictures of another shape than the camera's: each command says so, and its result does."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from optisense import load
from optisense.cli.app import app

NOTE = "a picture of 64x32 cuts off top and bottom of the camera's picture, which is 320x240"
DESIGN = "gelsight-mini-ideal"
FEW = ["--photons", "5000"]
FLAT = ["--resolution", "64x32"]


@pytest.mark.parametrize(
    ("own", "asked", "told"),
    [
        ((240, 320), (160, 120), ["cuts off", "240x320: use 120x160"]),
        ((240, 320), (120, 160), []),
        ((320, 240), (240, 320), ["above and below", "320x240: use 320x240"]),
        ((100, 100), (200, 50), ["use 100x100"]),
        ((240, 320), (320, 427), []),  # as near as whole pixels get
        ((3280, 2464), (1280, 960), []),  # within a hundredth
        ((320, 240), None, []),
    ],
)
def test_a_note_names_a_size_of_the_cameras_shape(
    own: tuple[int, int], asked: tuple[int, int] | None, told: list[str]
) -> None:
    camera = load(DESIGN).camera.model_copy(update={"resolution": own})
    notes = camera.shape_notes(asked, asked)
    assert len(notes) == bool(told)
    assert all(part in notes[0] for part in told)


@pytest.mark.parametrize(
    ("command", "file"),
    [
        (["render", DESIGN, *FLAT, *FEW], "run.json"),
        (["evaluate", DESIGN, "--objective", "aoap", *FLAT], "scores.json"),
        (["dataset", DESIGN, "--count", "1", *FLAT, *FEW], "dataset.json"),
        (
            ["task", "reconstruction", DESIGN, "--object", "sphere:3@0,0:0.5", "--presses", "1"]
            + ["--method", "table", "--skin", "conforming", *FLAT, *FEW],
            "result.json",
        ),
        (
            ["verify", DESIGN, DESIGN, "--object", "nut", "--places", "1", "--presses", "1"]
            + ["--method", "table", "--skin", "conforming", *FLAT, *FEW],
            "verify.json",
        ),
    ],
)
def test_a_command_and_its_result_say_it(command: list[str], file: str, tmp_path: Path) -> None:
    run = CliRunner().invoke(app, [*command, "--out", str(tmp_path)])
    assert run.exit_code == 0, run.output
    assert NOTE in " ".join(run.output.split())
    assert NOTE in " ".join(json.loads((tmp_path / file).read_text(encoding="utf-8"))["notes"])


def test_a_search_says_it(tmp_path: Path) -> None:
    command = ["search", DESIGN, "--vary", "camera.fov=60:70", "--objective", "aoap", "--json"]
    command += ["--budget", "2", "--set", "ray_resolution=[64,32]", "--out", str(tmp_path / "s")]
    run = CliRunner().invoke(app, command)
    assert run.exit_code == 0, run.output
    assert NOTE in run.stderr
    assert NOTE in " ".join(json.loads(run.stdout)["notes"])
