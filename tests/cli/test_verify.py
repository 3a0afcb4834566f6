"""`optisense verify`: what it prints, keeps and refuses."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from optisense import load, set_value
from optisense.cli import app
from optisense.commands.sampling import ALL_OBJECTS, VerifyOptions
from optisense.geometry.objects import OBJECTS
from optisense.search import search

TINY = ("--quick", "--object", "nut", "--places", "1", "--presses", "2", "--photons", "30000")
TINY += ("--resolution", "64x48")


def run(*arguments: str) -> tuple[int, str, str]:
    result = CliRunner().invoke(app, ["verify", *arguments])
    assert "Traceback" not in result.output
    return result.exit_code, result.stdout, result.output.replace("\n", " ")


def brighter(design: object) -> float:
    return float(design.lights["red"].flux)  # type: ignore[attr-defined]


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A search that ends with a brighter red light, and renders nothing."""
    folder = tmp_path_factory.mktemp("study") / "study"
    vary = {"lights.red.flux": (1.0, 9.0)}
    search(load("gelsight-mini-ideal"), vary, brighter, method="random", budget=4, out=folder)
    return folder


def test_a_study_is_compared_with_its_start(study: Path, tmp_path: Path) -> None:
    code, text, told = run(str(study), *TINY, "--out", str(tmp_path / "proof"))
    assert code == 0, told
    assert "error of normals" in text
    assert "the start" in text
    assert "1 object at one place" in text
    assert "a verdict needs 6 or more objects, and there were 1" in told
    assert "note:" not in text  # notes are no results
    assert "inconclusive" in told
    page = (tmp_path / "proof" / "verify.html").read_text()
    assert "Inconclusive" in page
    assert OBJECTS["nut"].help in page
    values = json.loads((tmp_path / "proof" / "verify.json").read_text())
    assert values["verdict"] == "inconclusive"
    assert values["before"]["name"] == "the start"
    assert values["after"]["name"].startswith("trial ")
    assert values["normals"]["before"] > 0.0


def test_one_design_alone_is_refused() -> None:
    code, _, told = run("gelsight-mini")
    assert code == 2
    assert "name a second design" in told


def test_a_folder_that_does_not_exist_is_told() -> None:
    code, _, told = run("nope")
    assert code == 2
    assert "no built-in sensor and no folder 'nope'" in told


def test_a_study_without_finished_trials_is_refused(tmp_path: Path) -> None:
    from optisense.search import Continuous, Plan, SearchSpace, Study

    space = SearchSpace({"lights.red.flux": Continuous(1.0, 9.0)})
    plan = Plan(space, [brighter], method="random", budget=4)
    Study.create(tmp_path / "new", load("gelsight-mini-ideal"), plan).close()
    code, _, told = run(str(tmp_path / "new"), "--quick")
    assert code == 2
    assert "no trial" in told


def test_a_study_whose_best_is_its_start_is_refused(study: Path, tmp_path: Path) -> None:
    vary = {"lights.red.flux": (1.0, 2.0)}
    bright = set_value(load("gelsight-mini-ideal"), "lights.red.flux", 2.0)
    search(bright, vary, brighter, method="random", budget=2, out=tmp_path / "vain")
    code, _, told = run(str(tmp_path / "vain"), "--quick")
    assert code == 2
    assert "no trial is better than the start" in told
    code, _, told = run(str(study), "--trial", "99")
    assert code == 2
    assert "no trial '99'" in told


def test_a_design_without_a_view_is_told_by_its_name(tmp_path: Path) -> None:
    from optisense.design import save_design

    away = set_value(load("gelsight-mini-ideal"), "camera.direction", [0.0, 0.0, -1.0])
    save_design(away, tmp_path / "away")
    code, _, told = run("gelsight-mini-ideal", str(tmp_path / "away"), *TINY)
    assert code == 2
    assert "of the sensing surface" in told or "no picture" in told


def test_the_options_know_how_many_objects_there_are() -> None:
    assert len(OBJECTS) == ALL_OBJECTS
    assert VerifyOptions().pictures() == 40 + 3 * len(OBJECTS)
    assert VerifyOptions(quick=True).settings().reading.width == 160
    assert VerifyOptions().settings().objects == tuple(OBJECTS)
