"""`optisense dataset`: what it makes, continues, and refuses."""

from __future__ import annotations

import signal
import subprocess
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
import yaml
from comparing import same_pictures
from typer.testing import CliRunner
from warm_python import programs

from optisense.cli import app
from optisense.tasks import Dataset

SMALL = ("--resolution", "48x36", "--photons", "60000", "--seed", "5")


def run(*arguments: str) -> tuple[int, str]:
    result = CliRunner().invoke(app, ["dataset", *arguments])
    assert "Traceback" not in result.output
    return result.exit_code, result.output


def test_a_dataset_is_made_and_continued(tmp_path: Path) -> None:
    folder = tmp_path / "not" / "yet"
    options = (*SMALL, "--indenter", "sphere:2", "--indenter", "cylinder:1,3", "--depth", "0.5")
    code, text = run(
        "gelsight-mini-ideal", "--out", str(folder), "--count", "2", *options, "--parquet"
    )
    assert code == 0, text
    assert "2 samples" in text
    assert "no sample is in the split" in text
    code, text = run("gelsight-mini-ideal", "--out", str(folder), "--count", "3", *options)
    assert code == 0, text
    assert "Parquet files were written again" in text
    files = sorted((folder / "parquet").iterdir())
    assert sum(len(pq.read_table(file)) for file in files) == 3
    written = [file.stat().st_mtime_ns for file in files]
    for more in ((), ("--parquet",)):  # nothing is added
        given = (*options, *more)
        code, text = run("gelsight-mini-ideal", "--out", str(folder), "--count", "3", *given)
        assert code == 0 and "written again" not in text
        assert [file.stat().st_mtime_ns for file in files] == written
    files[0].write_bytes(b"cut off")
    code, text = run("gelsight-mini-ideal", "--out", str(folder), "--count", "3", *options)
    assert "written again" in text
    assert sum(len(pq.read_table(file)) for file in files) == 3
    card = yaml.safe_load((folder / "README.md").read_text("utf-8").split("---")[1])
    named = [each["path"] for each in card["configs"][0]["data_files"]]
    assert sorted(file for path in named for file in folder.glob(path)) == files
    made = Dataset.load(folder)
    assert [labels["index"] for labels in made.labels] == [0, 1, 2]
    assert {labels["depth"] for labels in made.labels} == {0.5}
    assert made[2].image.shape == (36, 48, 3)
    code, text = run("gelsight-mini-ideal", "--out", str(folder), "--count", "3", *SMALL)
    assert code == 2
    assert 'settings.contacts.indenters: ["sphere:2", "cylinder:1,3"] -> ["' in text


@pytest.mark.parametrize(
    "arguments",
    [
        ("--count", "0"),
        ("--depth", "deep"),
        ("--depth", "1:0.5"),
        ("--depth", "0:1"),
        ("--tilt", "90"),
        ("--indenter", "ball:1"),
        ("--indenter", "mesh:nothing-here.stl"),
        ("--camera-noise", "-1"),
        ("--estimator", "guess"),
        ("--resolution", "tall"),
    ],
    ids=" ".join,
)
def test_bad_input_exits_with_2(arguments: tuple[str, ...], tmp_path: Path) -> None:
    code, text = run("gelsight-mini-ideal", "--out", str(tmp_path / "d"), *arguments)
    assert code == 2, text
    assert len(text) > 20


def test_where_no_contact_can_be_made_the_reason_is_told(tmp_path: Path) -> None:
    code, text = run(
        "gelsight-mini-ideal", "--out", str(tmp_path / "d"), "--depth", "9", "-n", "2", *SMALL
    )
    assert code == 1
    assert "2 contacts could not be made: a contact is 9 mm deep, but the gel there is" in text
    assert "failures.csv" in text


COMMAND = ("dataset", "gelsight-mini-ideal", *SMALL)

STRUCK = """
import os, sys
from pathlib import Path
from optisense.cli import app
from optisense.optics import OpticalModel

number, rows, *command = sys.argv[1:]
plain = OpticalModel.render

def render(self, *arguments, **options):
    written = Path(rows).read_bytes() if Path(rows).exists() else b""
    if written.count(b"\\n") == 3:  # the heading and two samples
        os.kill(os.getpid(), int(number))
    return plain(self, *arguments, **options)

OpticalModel.render = render
app(command)
"""
"""Runs a command; at the rendering after the second sample it gets a signal."""


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A dataset made in one go."""
    folder = tmp_path_factory.mktemp("whole")
    assert run("gelsight-mini-ideal", *SMALL, "--out", str(folder), "--count", "3")[0] == 0
    return folder


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL])
def test_stopped_amid_a_sample_it_continues_to_the_same(
    number: int, whole: Path, tmp_path: Path
) -> None:
    stopped = tmp_path / "stopped"
    command = (*COMMAND, "--out", str(stopped), "--count", "3")
    rows = stopped / "metadata.csv"
    child = subprocess.run(
        [programs() / "python", "-c", STRUCK, str(int(number)), str(rows), *command],
        stderr=subprocess.PIPE,
        text=True,
    )
    if number == signal.SIGINT:
        assert child.returncode == 130, child.stderr
        assert "the same command continues" in child.stderr
    else:
        assert child.returncode == -number
    assert len(Dataset.load(stopped)) == 2
    code, said = run(*command[1:])
    assert code == 0, said
    assert rows.read_bytes() == (whole / "metadata.csv").read_bytes()
    for one, other in zip(Dataset.load(stopped), Dataset.load(whole), strict=True):
        assert same_pictures(one.image, other.image)
        assert np.array_equal(one.depth, other.depth, equal_nan=True)
    assert not [path for path in stopped.rglob(".*") if path.is_file()]
