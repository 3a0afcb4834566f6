"""`optisense task`: what it prints, keeps, continues and refuses."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from typer.testing import CliRunner

from optisense.cli import app

SMALL = ("--resolution", "32x24", "--photons", "20000", "--seed", "5", "--skin", "conforming")


def run(*arguments: str) -> tuple[int, str]:
    result = CliRunner().invoke(app, ["task", *arguments])
    assert "Traceback" not in result.output
    return result.exit_code, result.stdout if "--json" in arguments else result.output


def test_misalignment_prints_writes_and_continues(tmp_path: Path) -> None:
    folder = tmp_path / "not" / "yet"
    command = ("misalignment", "gelsight-mini-ideal", *SMALL, "--range", "5", "--out", str(folder))
    code, text = run(*command, "-n", "10")
    assert code == 0, text
    assert "degrees" in text
    assert str(folder) in text.replace("\n", "")
    before = json.loads((folder / "result.json").read_text())
    rows = (folder / "samples.csv").read_text().splitlines()
    assert rows[0] == "mean_red,mean_green,mean_blue,angle_x,angle_y"
    angles = np.array([row.split(",")[3:] for row in rows[1:]], dtype=float)
    assert len(angles) == before["samples"] == 10
    assert np.abs(angles).max() <= 5
    assert np.asarray(Image.open(folder / "figure.png")).std() > 10
    code, text = run(*command, "-n", "12", "--json")
    assert code == 0, text
    values = json.loads(text)
    assert values == json.loads((folder / "result.json").read_text())
    assert values["samples"] == 12
    assert (folder / "samples.csv").read_text().splitlines()[:11] == rows
    code, text = run(*command, "-n", "12", "--depth", "0.7")
    assert code == 2
    assert "misalignment.depth: 0.8 -> 0.7" in text.replace("\n", " ")


def test_snr_runs_both_tasks(tmp_path: Path) -> None:
    options = ("--samples", "10", "--photons", "20000", "--neighbours", "3")
    options += ("--skin", "conforming", "--resolution")
    code, text = run(
        "snr", "gelsight-mini-ideal", *options, "48x36", "--out", str(tmp_path), "--json"
    )
    assert code == 0, text
    tasks = json.loads(text)["tasks"]
    assert [task["task"] for task in tasks] == ["misalignment", "cylinder-radius"]
    for task in tasks:
        assert task["signal_to_noise"] > 0
        assert task["settings"]["neighbours"] == 3
        assert (tmp_path / task["task"] / "figure.png").stat().st_size > 5000


@pytest.mark.slow
def test_reconstruction_of_given_objects(tmp_path: Path) -> None:
    ball = "sphere:3@0,0:0.5"
    options = ("--presses", "4", "--resolution", "64x48", "--photons", "20000", "--method", "table")
    options += ("--skin", "conforming")
    arguments = ("--object", ball, *options, "--out", str(tmp_path))
    code, text = run("reconstruction", "gelsight-mini-ideal", *arguments)
    assert code == 0, text
    values = json.loads((tmp_path / "result.json").read_text())
    assert list(values["objects"]) == [ball]
    assert values["units"] == {"normal_error": "degrees", "depth_error": "mm"}
    assert values["objects"][ball]["deepest"] == pytest.approx(0.5, abs=0.02)
    assert f"{values['normal_error']:.1f}" in text and "…" not in text
    assert np.asarray(Image.open(tmp_path / "figure.png")).std() > 10


@pytest.mark.parametrize(
    "arguments",
    [
        ("misalignment", "no-such-sensor"),
        ("misalignment", "gelsight-mini-ideal", "-n", "3"),
        ("misalignment", "gelsight-mini-ideal", "--range", "40"),
        ("misalignment", "gelsight-mini-ideal", "--crop", "2"),
        ("misalignment", "gelsight-mini-ideal", "-n", "20", "--neighbours", "20"),
        ("misalignment", "gelsight-mini-ideal", "--resolution", "tall"),
        ("misalignment", "gelsight-mini-ideal", "--estimator", "guess"),
        ("cylinder-radius", "gelsight-mini-ideal", "--radius", "6:1"),
        ("cylinder-radius", "gelsight-mini-ideal", "--radius", "thin"),
        ("cylinder-radius", "gelsight-mini-ideal", "--depth", "9"),
        ("snr", "gelsight-mini-ideal", "--camera-noise", "-1"),
        ("reconstruction", "gelsight-mini-ideal", "--method", "guess"),
        ("reconstruction", "gelsight-mini-ideal", "--depth", "0.2:9"),
        ("reconstruction", "gelsight-mini-ideal", "--object", "ball:3"),
        ("reconstruction", "gelsight-mini-ideal", *2 * ("--object", "sphere:3@0,0:0.5")),
        ("reconstruction", "gelsight-mini-ideal", "--object", "sphere:3@90,0:0.5"),
    ],
    ids=" ".join,
)
def test_bad_input_exits_with_2(arguments: tuple[str, ...], tmp_path: Path) -> None:
    out = tmp_path / "o"
    code, text = run(*arguments, "--out", str(out))
    assert code == 2, text
    assert len(text) > 20
    assert not list(out.glob("*.csv")) or "estimator" in text
