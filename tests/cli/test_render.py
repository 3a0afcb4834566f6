"""`optisense render`: the files it writes, and what it does when something is in the way."""

from __future__ import annotations

import json
import os
import re
import subprocess
from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image
from typer.testing import CliRunner
from warm_python import programs

from optisense.cli import app

SMALL = ("--resolution", "40x30", "--photons", "20000")
BALL = ("--contact", "sphere:1.5@0,0:0.8")
LAYERS = ("red", "green", "blue")

FILES = {
    "image.png",
    "radiance.exr",
    "normals.npy",
    "contact_mask.npy",
    "pressure.npy",
    "run.json",
    "report.html",
    *(f"layers/{name}.exr" for name in LAYERS),
}


def render(*arguments: str, design: str = "gelsight-mini-ideal") -> tuple[int, str]:
    result = CliRunner().invoke(app, ["render", design, *arguments])
    assert "Traceback" not in result.output
    return result.exit_code, result.output


def child(script: str, folder: Path) -> subprocess.CompletedProcess[str]:
    """Run a script in a process of its own, with the output folder as its argument."""
    return subprocess.run(
        [programs() / "python", "-c", script, str(folder)], capture_output=True, text=True
    )


def written(folder: Path) -> set[str]:
    return {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()}


def test_an_indenter_in_metres_is_told(tmp_path: Path) -> None:
    """A cube of 15 mm whose file is in metres, pressed 0.5 mm deep."""
    file = tmp_path / "cube.stl"
    trimesh.creation.box((0.015, 0.015, 0.015)).export(file)
    hint = f"mesh:{file},1000"
    words = ("--contact", f"mesh:{file}@0,0:0.5")
    _, said = render(*words, *SMALL, "--out", str(tmp_path / "out"))
    flat = "".join(said.split())
    assert "anindenter0.015mmlargeispressed0.5mmdeep" in flat
    assert hint in flat
    assert "warning:nopixelseesacontact" in flat
    for text, warned in ((f"mesh:{file}@0,0:0.5", True), (f"{hint}@0,0:0.5", False)):
        result = CliRunner().invoke(app, ["check", "gelsight-mini-ideal", "--contact", text])
        assert result.exit_code == 0
        assert ("mm large" in result.output) == warned


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A finished render of a ball on a GelSight Mini."""
    path = tmp_path_factory.mktemp("render") / "not" / "there" / "yet"
    code, text = render(*SMALL, *BALL, "--seed", "7", "--out", str(path), design="gelsight-mini")
    assert code == 0, text
    assert str(path / "image.png") in text
    assert str(path / "report.html") in text
    return path


def test_every_promised_file_is_there_and_nothing_else(folder: Path) -> None:
    assert written(folder) == FILES


def test_the_report_tells_where_the_light_goes(folder: Path) -> None:
    report = (folder / "report.html").read_text(encoding="utf-8")
    assert "Where the light goes" in report and "escaped from tray" in report


def test_the_files_have_the_wanted_size(folder: Path) -> None:
    assert Image.open(folder / "image.png").size == (40, 30)
    assert np.load(folder / "normals.npy").shape == (30, 40, 3)
    mask = np.load(folder / "contact_mask.npy")
    assert mask.shape == (30, 40)
    assert mask.dtype == bool


def test_the_pressure_adds_up_to_the_force(folder: Path) -> None:
    pressure = np.load(folder / "pressure.npy")
    press = json.loads((folder / "run.json").read_text())["presses"][0]
    # Pixels of 20.3 mm / 40 on a flat gel; the contact is five of them across.
    assert pressure.sum() * (20.3 / 40) ** 2 == pytest.approx(press["force_n"], rel=0.15)
    assert 0.6 < pressure.max() / press["greatest_pressure_mpa"] <= 1.0


def test_the_ball_is_in_the_middle_of_the_picture(folder: Path) -> None:
    rows, columns = np.nonzero(np.load(folder / "contact_mask.npy"))
    assert abs(rows.mean() - 14.5) < 1.0
    assert abs(columns.mean() - 19.5) < 1.0


def test_run_json_says_how_it_was_made(folder: Path) -> None:
    run = json.loads((folder / "run.json").read_text())
    assert run["seed"] == 7
    assert run["design"] == "gelsight-mini"
    assert run["contacts"] == ["sphere:1.5@0,0:0.8"]


def test_the_report_asks_the_network_for_nothing(folder: Path) -> None:
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert "default-src 'none'" in page
    assert not re.findall(r"""(?:src|href|action)\s*=\s*["'](?!data:)""", page)
    assert not re.findall(r"url\(|@import|fetch\(|XMLHttpRequest", page)
    shown = (
        "image",
        "image",
        *LAYERS,
        *2 * LAYERS,  # for the mixer, coarse and fine
        "normals",
        "mask",
        "pressure",
        "a real sensor",
        "the model of it",
    )
    assert page.count("data:image/png;base64,") == len(shown)


@pytest.mark.parametrize(
    "arguments",
    [
        ("--resolution", "wide"),
        ("--resolution", "0x10"),
        ("--photons", "0"),
        ("--noise", "0"),
        ("--noise", "5", "--seconds", "2"),
        ("--exposure", "bright"),
        ("--exposure", "-1"),
        ("--seed", "-1"),
        ("--variant", "opencl"),
        ("--contact", "sphere:1.5@90,0:0.5"),
        ("--contact", "sphere:1.5@0,0:9"),
        ("--contact", "ball"),
    ],
    ids=" ".join,
)
def test_bad_input_exits_with_2(arguments: tuple[str, ...], tmp_path: Path) -> None:
    code, text = render(*arguments, "--out", str(tmp_path / "out"))
    assert code == 2, text
    assert len(text) > 20


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_folder_without_write_permission_is_an_error(tmp_path: Path) -> None:
    tmp_path.chmod(0o500)
    code, text = render(*SMALL, "--out", str(tmp_path / "out"))
    tmp_path.chmod(0o700)
    assert code == 1
    assert "can't be written" in text


def test_ctrl_c_writes_what_there_is_and_exits_with_130(tmp_path: Path) -> None:
    script = """
import signal, sys
from optisense.cli import app
from optisense.optics import OpticalModel

plain = OpticalModel.render

def render(self, *arguments, progress, **options):
    pressed = []
    def press_once(state):
        if not pressed:
            pressed.append(True)
            signal.raise_signal(signal.SIGINT)
        progress(state)
    return plain(self, *arguments, progress=press_once, **options)

OpticalModel.render = render
options = ["--resolution", "40x30", "--seconds", "200", "--out", sys.argv[1]]
app(["render", "gelsight-mini-ideal", *options])
"""
    result = child(script, tmp_path / "out")
    assert result.returncode == 130, result.stderr
    assert "Traceback" not in result.stderr
    assert written(tmp_path / "out") == FILES - {"pressure.npy"}  # nothing presses
    assert "was interrupted" in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert json.loads((tmp_path / "out" / "run.json").read_text())["interrupted"] is True


def test_a_disk_that_fills_up_is_an_error_and_leaves_no_half_files(tmp_path: Path) -> None:
    # A limit on the size of files fails a write midway, as a full disk does.
    script = """
import resource, sys
from optisense.cli import app
from optisense.optics import TactileImage

plain = TactileImage.save

def save(self, *arguments):
    resource.setrlimit(resource.RLIMIT_FSIZE, (9000, 9000))
    plain(self, *arguments)

TactileImage.save = save
app(["render", "gelsight-mini-ideal", "--resolution", "40x30", "--photons", "20000",
     "--out", sys.argv[1]])
"""
    result = child(script, tmp_path / "out")
    assert result.returncode == 1, result.stderr
    assert "Traceback" not in result.stderr
    assert "can't be written" in result.stderr
    names = written(tmp_path / "out")
    assert not any(Path(name).name.startswith(".") for name in names)
    assert "radiance.exr" not in names
