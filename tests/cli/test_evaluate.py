"""`optisense evaluate`: table, JSON, report, exit codes."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner
from warm_python import programs

from optisense.cli import app
from optisense.objectives import names

SMALL = ("--resolution", "120x90", "--photons", "50000", "--set", "places=[[0,0],[3,2]]")
RAYS = ("--objective", "aoap", "--objective", "2to3pw")

OWN = '''
def fails(evaluation):
    raise RuntimeError("the gel is torn")

def scores(evaluation):
    """Always four."""
    return 4.0, {"note": "as ever", "places": [{"place": 1, "score": 4.0}]}
'''


def evaluate(*arguments: str, design: str = "gelsight-mini-ideal") -> tuple[int, str, str]:
    """Exit code, standard output, standard error."""
    result = CliRunner().invoke(app, ["evaluate", design, *arguments])
    assert "Traceback" not in result.output
    return result.exit_code, result.stdout, result.stderr


def test_objectives_are_listed_without_a_design() -> None:
    result = CliRunner().invoke(app, ["evaluate", "--objectives"])
    assert result.exit_code == 0, result.output
    assert [line.split()[0] for line in result.stdout.splitlines()] == names()


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Everything, with two seeds and a report."""
    path = tmp_path_factory.mktemp("evaluate") / "scores"
    code, text, _ = evaluate(*SMALL, "--seeds", "2", "--seed", "5", "--report", "--out", str(path))
    assert code == 0, text
    for words in ("RGB2Normal", "NormDiff", "AOAP", "2to3PW", "coverage", "±"):
        assert words in text
    return path


def test_only_the_promised_files_are_written(folder: Path) -> None:
    assert {path.name for path in folder.iterdir()} == {"scores.json", "scores.html"}


def test_the_json_file_has_all_parts_and_the_spread(folder: Path) -> None:
    content = json.loads((folder / "scores.json").read_text())
    assert content["design"] == "gelsight-mini-ideal"
    assert content["settings"]["seed"] == 5
    assert content["settings"]["resolution"] == [120, 90]
    assert list(content["scores"]) == ["rgb2normal", "normdiff", "aoap", "2to3pw"]
    rgb2normal = content["scores"]["rgb2normal"]
    assert len(rgb2normal["parts"]["places"]) == 2
    assert len(rgb2normal["parts"]["places"][0]["directions"]) == 8
    assert 0 < content["scores"]["aoap"]["parts"]["coverage"] <= 1
    seeds = content["seeds"]["rgb2normal"]
    assert list(seeds["values"]) == ["5", "6"]
    first, second = seeds["values"].values()
    assert seeds["mean"] == pytest.approx((first + second) / 2)
    assert seeds["standard_deviation"] == pytest.approx(abs(first - second) / 2**0.5)
    # Chief rays know no chance.
    assert content["seeds"]["aoap"]["standard_deviation"] == 0.0


def test_the_report_shows_each_score_and_asks_the_network_for_nothing(folder: Path) -> None:
    page = (folder / "scores.html").read_text(encoding="utf-8")
    assert "default-src 'none'" in page
    assert not re.findall(r"""(?:src|href|action)\s*=\s*["'](?!data:)""", page)
    assert not re.findall(r"url\(|@import|<script", page)
    assert page.count("data:image/png;base64,") == 4
    for words in ("RGB2Normal", "NormDiff", "AOAP", "2to3PW", "<svg", "section through"):
        assert words in page
    assert page.rstrip().endswith("</html>")


def test_json_is_all_that_is_printed() -> None:
    code, text, _ = evaluate(*RAYS, "--resolution", "40x30", "--json")
    assert code == 0
    content = json.loads(text)
    assert list(content["scores"]) == ["aoap", "2to3pw"]
    assert content["scores"]["aoap"]["parts"]["pixels"] == 1200


def test_a_failure_is_told_the_rest_goes_on_and_the_exit_code_is_1(tmp_path: Path) -> None:
    file = tmp_path / "own.py"
    file.write_text(OWN)
    arguments = ("-b", f"{file}:fails", "-b", f"{file}:scores", "-b", "aoap", "--resolution", "9x8")
    code, text, _ = evaluate(*arguments)
    assert code == 1
    assert "the gel is torn" in text
    assert re.search(r"scores\s+4\b", text)
    assert "AOAP" in text
    out = tmp_path / "out"
    code, text, _ = evaluate(*arguments, "--json", "--report", "--out", str(out))
    assert code == 1
    assert json.loads(text)["scores"]["fails"]["value"] is None
    page = (out / "scores.html").read_text()
    assert "the gel is torn" in page
    assert "Always four" in page


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (("-b", "aopa"), "Did you mean 'aoap'"),
        (("-b", "aoap", "-b", "AOAP"), "named twice"),
        (("-b", "nothing.py"), "no file"),
        (("--set", "depth"), "NAME=VALUE"),
        (("--set", "depth=[1"), "can't be read"),
        (("--set", "depth=0.4", "--set", "depth=0.5"), "'depth' is given twice"),
        (("--set", "depth=9"), "9"),
        (("--set", "photons=1e30"), "more than 10,000,000,000"),
        (("--set", "dept=0.2"), "Did you mean 'depth'"),
        (("--resolution", "wide"), "WIDTHxHEIGHT"),
        (("--seeds", "0"), "seeds"),
        (("--report",), "--out"),
        (("--variant", "opencl"), "opencl"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, tuple) else "",
)
def test_bad_input_exits_with_2(arguments: tuple[str, ...], complaint: str) -> None:
    code, text, errors = evaluate(*arguments)
    assert code == 2, text + errors
    assert complaint in errors


def test_settings_are_read_as_numbers_are_written() -> None:
    from optisense.commands.options import read_named

    read = read_named(["exposure=1e-9", "half-lines=true", "places=[[0, 1e0]]", "colours=no"])
    assert read == {
        "exposure": 1e-9,
        "half_lines": True,
        "places": [[0, 1.0]],
        "colours": "no",
    }


def test_an_unknown_sensor_exits_with_2() -> None:
    code, _, errors = evaluate("-b", "aoap", design="gelsight-minni")
    assert code == 2
    assert "gelsight-mini" in errors


PRESSED = """
import signal, sys
from optisense.cli import app
from optisense.objectives import names
from optisense import objective

def pressed(evaluation):
    signal.raise_signal(signal.SIGINT)
    return 1.0

objective("pressed", title="Pressed")(pressed)
app(["evaluate", "gelsight-mini-ideal", "-b", "aoap", "-b", "pressed", "-b", "2to3pw",
     "--resolution", "40x30", "--out", sys.argv[1]])
"""


def test_ctrl_c_shows_what_is_finished_and_exits_with_130(tmp_path: Path) -> None:
    child = subprocess.run(
        [programs() / "python", "-c", PRESSED, str(tmp_path / "out")],
        capture_output=True,
        text=True,
    )
    assert child.returncode == 130, child.stderr
    assert "Traceback" not in child.stderr
    assert "AOAP" in child.stdout
    written = json.loads((tmp_path / "out" / "scores.json").read_text())
    assert list(written["scores"]) == ["aoap"]


def test_in_the_background_ctrl_c_stays_ignored(tmp_path: Path) -> None:
    """As a shell without job control arranges it for what it starts by `&`."""
    background = ["sh", "-c", 'trap "" INT; exec "$@"', "sh"]
    child = subprocess.run(
        [*background, sys.executable, "-c", PRESSED, str(tmp_path / "out")],
        capture_output=True,
        text=True,
    )
    assert child.returncode == 0, child.stderr
    written = json.loads((tmp_path / "out" / "scores.json").read_text())
    assert list(written["scores"]) == ["aoap", "pressed", "2to3pw"]
