"""`optisense search` and `optisense apply`, by a user's own cheap objective."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
from contextlib import closing
from pathlib import Path

import pytest
from typer.testing import CliRunner
from warm_python import programs

import optisense as ots
from optisense.cli import app
from optisense.report.study import render_study
from optisense.search import Study

OBJECTIVE = """
import os
import signal

def near(evaluation):
    design = evaluation.design
    if os.environ.get("PRESS_CTRL_C") and design.coating.specularity > 0.0:
        os.kill(os.getpid(), signal.SIGINT)
    return -((design.coating.specularity - 0.3) ** 2)

def picky(design):
    if design.coating.specularity in (0.0, 0.2):
        raise RuntimeError("it is too dull")
    return 1.0

def shy(evaluation):
    raise RuntimeError("I have nothing to say")

def dull(design):
    return design.coating.specularity < 0.5 or "too shiny"
"""


@pytest.fixture(scope="module")
def mine(tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("mine") / "mine.py"
    file.write_text(OBJECTIVE)
    return file


@pytest.fixture(scope="module")
def study(mine: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A finished study of eleven coatings."""
    folder = tmp_path_factory.mktemp("studies") / "study"
    result = run("gelsight-mini-ideal", "--vary", "coating.specularity=0:1:11",
                 "-b", f"{mine}:near", "--method", "grid",
                 "--rule", f"{mine}:dull", "--out", folder)  # fmt: skip
    assert result.exit_code == 0, result.output
    assert "11 trials: the method has finished" in result.output
    assert "best: trial 4, near 0 (start -0.09)" in result.output
    assert "coating.specularity = 0.3" in result.output
    assert "6 trials failed:\n  6 trials: too shiny" in result.output
    assert f"optisense apply {folder} --trial best" in result.output
    return folder


def run(*words: object) -> object:
    return CliRunner().invoke(app, ["search", *map(str, words)])


def test_a_rule_that_is_not_there_is_told_before_the_first_trial(
    mine: Path, tmp_path: Path
) -> None:
    for rule, said in ((tmp_path / "no.py:f", "no file"), (f"{mine}:none", "no function 'none'")):
        result = run("gelsight-mini-ideal", "--vary", "coating.specularity=0:1",
                     "-b", f"{mine}:near", "--rule", rule, "--out", tmp_path / "study")  # fmt: skip
        assert result.exit_code == 2
        assert said in result.output and "trials" not in result.output
        assert not (tmp_path / "study").exists()


def test_sizes_and_photons_are_given_as_for_a_score(tmp_path: Path) -> None:
    words = ("gelsight-mini-ideal", "--vary", "coating.specularity=0:1:2", "-b", "aoap")
    out = tmp_path / "study"
    result = run(*words, "--method", "grid", "--resolution", "40x30", "--photons", "draft",
                 "--out", out)  # fmt: skip
    assert result.exit_code == 0, result.output
    settings = Study.open(out).settings.settings
    assert settings == {"photons": 60_000, "resolution": [40, 30], "ray_resolution": [40, 30]}
    again = run("--resume", "--out", out, "--set", "resolution=40x30",
                "--set", "ray_resolution=40x30", "--photons", "draft")  # fmt: skip
    assert again.exit_code == 0, again.output
    other = run(*words, "--set", "resolution=40", "--out", tmp_path / "other")
    assert other.exit_code == 2 and "resolution" in other.output


def test_the_study_holds_all_trials(study: Path) -> None:
    opened = Study.open(study)
    assert len(opened.trials) == 12
    assert opened.settings.rules[0].endswith("mine.py:dull")
    assert opened.best is not None
    assert opened.best.values == {"coating.specularity": pytest.approx(0.3)}


def test_apply_writes_the_better_design(study: Path, tmp_path: Path) -> None:
    out = tmp_path / "better"
    result = CliRunner().invoke(app, ["apply", str(study), "--trial", "best", "--out", str(out)])
    assert result.exit_code == 0, result.output
    design = ots.load(out)
    assert design.coating.specularity == pytest.approx(0.3)
    assert "trial 4 of a grid search for near" in design.provenance["coating.specularity"].source
    ots.check(design)
    again = CliRunner().invoke(app, ["apply", str(study), "--out", str(out)])
    assert again.exit_code == 1
    assert "not empty" in again.output
    other = CliRunner().invoke(
        app, ["apply", str(study), "--trial", "11", "--out", str(tmp_path / "last")]
    )
    assert other.exit_code == 0
    assert ots.load(tmp_path / "last").coating.specularity == 1.0
    for which, said in (("99", "trials 0 to 11"), ("worst", "best, start, or its number")):
        wrong = CliRunner().invoke(app, ["apply", str(study), "--trial", which, "--out", "x"])
        assert wrong.exit_code == 2
        assert said in wrong.output


def test_apply_marks_what_was_moved(mine: Path, tmp_path: Path) -> None:
    """A row of lights, one light, a part and the camera; the other rows stay as they were."""
    moved = ("lights.blue.shift.x", "lights.green.lights[1].turn.z", "parts.guide.shift.x",
             "camera.turn.z")  # fmt: skip
    varied = [word for path in moved for word in ("--vary", f"{path}=0.01:0.02")]
    folder, out = tmp_path / "study", tmp_path / "moved"
    assert run("gelsight-mini-ideal", *varied, "-b", f"{mine}:near", "--budget", 1,
               "--out", folder).exit_code == 0  # fmt: skip
    words = ["apply", str(folder), "--trial", "1", "--out", str(out)]
    assert CliRunner().invoke(app, words).exit_code == 0
    marked = {path for path, each in ots.load(out).provenance.items() if "trial 1" in each.source}
    groups = {"lights.blue", "lights.green"}  # have a source in the sensor, which holds no longer
    moves = {"lights.blue.lights", "lights.green.lights[1]", "parts.guide", "camera.up"}
    assert marked == groups | moves


def test_json(study: Path) -> None:
    result = run("--resume", "--out", study, "--json")
    found = json.loads(result.stdout)
    assert found["trials"] == 11
    assert found["failed"] == 6
    assert found["best"]["number"] == 4
    assert found["best"]["values"] == {"coating.specularity": pytest.approx(0.3)}
    assert found["start"]["scores"]["near"] == pytest.approx(-0.09)
    assert not found["interrupted"]


def test_json_counts_the_start_nowhere(mine: Path, tmp_path: Path) -> None:
    result = run("gelsight-mini-ideal", "--vary", "coating.specularity=0.2:0.3:2", "--method",
                 "grid", "-b", f"{mine}:picky", "--out", tmp_path / "study", "--json")  # fmt: skip
    found = json.loads(result.stdout)
    assert found["start"]["scores"] == {"picky": None}
    assert (found["trials"], found["failed"], found["broken"]) == (2, 1, 0)


def test_commands_can_be_copied_to_a_shell(study: Path, tmp_path: Path) -> None:
    copy = tmp_path / "my study"
    shutil.copytree(study, copy)
    result = run("--resume", "--out", copy)
    assert f"optisense apply '{copy}' --trial best" in result.output
    assert f"optisense verify '{copy}'" in result.output


def test_a_start_that_is_not_beaten(mine: Path, tmp_path: Path) -> None:
    result = run("gelsight-mini-ideal", "--vary", "coating.specularity=0.7:1:2",
                 "-b", f"{mine}:near", "--method", "grid",
                 "--out", tmp_path / "study", "--variant", "llvm")  # fmt: skip
    assert result.exit_code == 0, result.output
    assert "best: trial 0" in result.output
    assert "no trial is better than the start" in result.output
    assert "optisense apply" not in result.output


def test_resume_takes_no_other_settings(study: Path, mine: Path) -> None:
    for words, said in (
        (["--seed", "4"], "seed: 0 -> 4"),
        (["--method", "random"], "method: grid -> random"),
        (["--vary", "coating.specularity=0:0.9:11"], "high: 1 -> 0.9"),
        (["-b", "aoap"], "-> aoap"),
        (["--set", "depth=0.2"], "settings"),
    ):
        result = run("--resume", "--out", study, *words)
        assert result.exit_code == 2, words
        assert said in result.output
    same = run(
        "gelsight-mini-ideal", "--resume", "--out", study, "--method", "grid", "-b", f"{mine}:near"
    )
    assert same.exit_code == 0, same.output


def test_an_edited_design_is_refused(study: Path, tmp_path: Path) -> None:
    ots.save_design(
        ots.set_value(ots.load("gelsight-mini-ideal"), "lights.red.flux", 12.0), tmp_path
    )
    result = run(tmp_path, "--resume", "--out", study)
    assert result.exit_code == 2
    assert "-> 12" in result.output


def test_a_study_that_was_edited_is_refused_with_the_difference(
    study: Path, tmp_path: Path
) -> None:
    copy = tmp_path / "study"
    shutil.copytree(study, copy)
    design = copy / "design"
    edited = ots.set_value(ots.load_design(design), "lights.red.flux", 12.0)
    vertices = edited.meshes["gel"].vertices.copy()
    vertices[0] += 0.01
    edited.meshes["gel"] = edited.meshes["gel"].with_vertices(vertices)
    ots.save_design(edited, design)
    result = run("--resume", "--out", copy)
    assert result.exit_code == 2
    flux = ots.load("gelsight-mini-ideal").lights["red"].flux
    assert f"lights.red.flux: {flux:g} -> 12" in result.output
    assert "mesh of part 'gel': vertices moved" in result.output
    assert len(result.output.splitlines()) < 8  # no more than what was edited

    shutil.rmtree(design)
    shutil.copytree(study / "design", design)
    assert run("--resume", "--out", copy).exit_code == 0
    settings = copy / "study.json"
    settings.write_text(settings.read_text().replace('"method": "grid"', '"method": "random"'))
    result = run("--resume", "--out", copy)
    assert result.exit_code == 2
    assert "method: grid -> random" in result.output


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["gelsight-mini-ideal"], "name a folder for the study"),
        (["--out", "x"], "name the design to start from"),
        (["gelsight-mini-ideal", "--out", "x"], "must be given at least once"),
        (["gelsight-mini-ideal", "--out", "x", "--vary", "a=0:1"], "must be given at least once"),
        (["gelsight-mini-ideal", "--out", "x", "-b", "aoap", "--vary", "coating.speculaity=0:1"],
         "Did you mean 'specularity'"),
        (["gelsight-mini-ideal", "--out", "x", "-b", "aoap", "--vary", "coating.specularity=1:0"],
         "reversed"),
        (["gelsight-mini-ideal", "--out", "x", "-b", "aopa", "--vary", "coating.specularity=0:1"],
         "Did you mean 'aoap'"),
        (["gelsight-mini-ideal", "--out", "x", "-b", "aoap", "--vary", "coating.specularity=0:1",
          "--method", "gird"], "Did you mean 'grid'"),
        (["gelsight-mini-ideal", "--out", "x", "-b", "aoap", "--vary", "coating.specularity=0:1",
          "--option", "sigmas=1"], "Did you mean 'sigma'"),
        (["gelsight-mini-ideal", "--out", "x", "-b", "aoap", "--vary", "coating.specularity=0:1",
          "--cluster", "here"], "is not the address"),
        (["--resume", "--out", "x"], "no study in this folder"),
    ],
)  # fmt: skip
def test_bad_input_is_told_and_leaves_nothing(
    words: list[str], said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    result = run(*words)
    assert result.exit_code in (1, 2)
    assert said in result.output
    assert "Traceback" not in result.output
    assert list(tmp_path.iterdir()) == []


def test_a_search_that_can_not_succeed_is_hinted_at(tmp_path: Path) -> None:
    words = ("gelsight-mini-ideal", "--vary", "coating.specularity=0:1", "--budget", "1")
    found = run(*words, "--out", tmp_path / "rays", "-b", "aoap")
    assert found.exit_code == 0, found.output
    assert "all trials will score alike" in " ".join(found.output.split())
    found = run("gelsight-mini-ideal", "--vary", "camera.fov=50:60", "--budget", "1",
                "--out", tmp_path / "view", "-b", "aoap")  # fmt: skip
    assert found.exit_code == 0 and "score alike" not in found.output


def test_trials_without_a_further_value_have_not_failed(mine: Path, tmp_path: Path) -> None:
    study = tmp_path / "study"
    result = run("gelsight-mini-ideal", "--vary", "coating.specularity=0.2:0.3:2", "-b",
                 f"{mine}:near", "-b", f"{mine}:shy", "--method", "grid",
                 "--out", study)  # fmt: skip
    assert result.exit_code == 0, result.output
    lacking = "2 trials and the start"
    assert f"{lacking} without a value of shy:\n  {lacking}: shy: Run" in result.output
    assert "  shy failed" in result.output
    assert "trials failed" not in result.output
    with closing(Study.open(study)) as opened:
        page = render_study(opened)
    assert f'<span class="soft">without a value of shy</span> <b>{lacking}</b>' in page
    assert f'<td class="tight">{lacking}</td>' in page
    assert "Trials without a value of shy, by cause" in page
    assert "Trial 2 is the best by near, the first objective, but another" in page


def test_an_objective_that_always_fails(mine: Path, tmp_path: Path) -> None:
    result = run("gelsight-mini-ideal", "--vary", "coating.specularity=0:1", "-b", f"{mine}:shy",
                 "--out", tmp_path / "study", "--budget", 500)  # fmt: skip
    assert result.exit_code == 2
    assert "trials so far have failed" in result.output
    assert "I have nothing to say" in result.output


@pytest.mark.slow
def test_ctrl_c_keeps_what_is_finished(mine: Path, tmp_path: Path) -> None:
    """Pressed during the first trial after the start: that trial still counts."""
    command = ["search", "gelsight-mini-ideal", "--vary", "coating.specularity=0.1:1", "-b",
               f"{mine}:near", "--out", str(tmp_path / "study"), "--budget", "30"]  # fmt: skip
    child = subprocess.run(
        [programs() / "optisense", *command],
        env={**os.environ, "PRESS_CTRL_C": "1"},
        capture_output=True,
        text=True,
    )
    assert child.returncode == 130, child.stderr
    assert "optisense search --resume --out" in child.stderr
    opened = Study.open(tmp_path / "study")
    assert 1 <= len(opened.trials) <= 2
    opened.close()
    result = run("--resume", "--out", tmp_path / "study", "--workers", "2")
    assert result.exit_code == 0, result.output
    assert len(Study.open(tmp_path / "study").trials) == 31


def test_ctrl_c_while_the_sensor_is_prepared_says_that_nothing_is_kept(tmp_path: Path) -> None:
    file = tmp_path / "early.py"
    file.write_text("import os, signal, time\nos.kill(os.getpid(), signal.SIGINT)\ntime.sleep(9)\n")
    child = subprocess.run(
        [programs() / "optisense", "search", "gelsight-mini-ideal", "--vary", "camera.fov=50:60",
         "-b", f"{file}:near", "--out", str(tmp_path / "study")],
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
        capture_output=True,
        text=True,
    )  # fmt: skip
    assert child.returncode == 130
    assert "no study was kept; give the same command again" in child.stderr
    assert not (tmp_path / "study").exists()


def test_methods_are_listed() -> None:
    result = run("--methods")
    assert result.exit_code == 0
    for name in ("grid", "random", "cma-es", "gradient", "pareto", "types", "light-colours"):
        assert any(line.startswith(name) for line in result.output.splitlines())
