"""Searches by the engine are watched, stopped and resumed, and can outlive it."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from optisense.design import load_design

OBJECTIVE = """
import time
from pathlib import Path

HOLD = Path(__file__).with_name("hold")

def shine(evaluation):
    '''Best at a specularity of 0.5, and at a camera further up; renders nothing.

    It takes longer while the file `hold` is there, so that a search lasts.
    '''
    design = evaluation.design
    if HOLD.exists():
        time.sleep(0.2)
    return -abs(design.coating.specularity - 0.5) + 0.01 * design.camera.position[2]
"""

TICKETS = """
import contextlib
import time
from pathlib import Path

FOLDER = Path(__file__).with_name("tickets")

def shine(evaluation):
    '''Renders nothing, and waits for a ticket while the folder of tickets is there.'''
    while FOLDER.exists():
        with contextlib.suppress(FileNotFoundError):
            next(FOLDER.iterdir(), FOLDER / "none").unlink()
            break
        time.sleep(0.02)
    return -abs(evaluation.design.coating.specularity - 0.5)
"""


@pytest.fixture
def goal(tmp_path: Path) -> str:
    file = tmp_path / "goal.py"
    file.write_text(OBJECTIVE)
    return f"{file}:shine"


@pytest.fixture
def hold(tmp_path: Path) -> Path:
    """While this file is there, each trial takes longer."""
    file = tmp_path / "hold"
    file.touch()
    return file


def test_a_search_is_watched_to_its_end(engine: Any, tmp_path: Path, goal: str) -> None:
    study = str(tmp_path / "study")
    number = engine.send(
        "search",
        design="gelsight-mini-ideal",
        study=study,
        vary=["coating.specularity=0:1:5"],
        objectives=[goal],
        method="grid",
    )
    result = engine.result(number)
    assert (result["done"], result["failed"], result["interrupted"]) == (5, 0, False)
    begun = engine.events(number, "begun")[0]
    assert (begun["budget"], begun["objectives"]) == (5, ["shine"])
    trials = engine.events(number, "trial")
    assert sorted(each["number"] for each in trials) == list(range(6))
    best = [each for each in trials if each["best"]]
    scores = [each["scores"]["shine"] for each in best]
    assert scores == sorted(scores)
    assert best[-1]["values"] == {"coating.specularity": 0.5}
    assert best[-1]["number"] == result["best"]
    about = engine.ask("study", study=study)
    assert (about["running"], about["best"], len(about["curve"])) == (False, result["best"], 6)
    one = engine.ask("trial", study=study, trial="best")
    assert one["data"]["coating"]["specularity"] == 0.5
    engine.ask("apply", study=study, to=str(tmp_path / "better"))
    assert load_design(tmp_path / "better").coating.specularity == 0.5
    taken = engine.refused(
        "search",
        design="gelsight-mini-ideal",
        study=study,
        vary=["coating.specularity=0:1:5"],
        objectives=["aoap"],
    )
    assert taken["kind"] == "SearchError" and "already" in taken["message"]


def test_the_best_so_far_comes_with_its_shapes(engine: Any, tmp_path: Path, goal: str) -> None:
    file = tmp_path / "bend.py"
    file.write_text(
        "def bend(evaluation):\n"
        "    return float(evaluation.design.deformed_meshes()['gel'].vertices[:, 2].mean())\n"
    )
    number = engine.send(
        "search",
        design="gelsight-mini-ideal",
        study=str(tmp_path / "study"),
        vary=["cages.skin.points[14].z=-1:1:3"],
        objectives=[f"{file}:bend"],
        method="grid",
        may_cross=True,
    )
    engine.result(number)
    best = [each for each in engine.events(number, "trial") if each["best"]][-1]
    assert set(best["shapes"]) == {"skin", "gel"}
    shown = np.load(best["shapes"]["gel"]["vertices"])
    assert shown[:, 2].mean() == pytest.approx(best["scores"]["bend"], abs=1e-4)


def test_mistakes_are_told_before_anything_is_begun(engine: Any, tmp_path: Path) -> None:
    study = tmp_path / "study"
    given = {"design": "gelsight-mini-ideal", "study": str(study), "objectives": ["aoap"]}
    wrong = engine.refused("search", vary=["coating.shine=0:1"], **given)
    assert wrong["kind"] in ("DesignError", "SearchError") and "shine" in wrong["message"]
    wrong = engine.refused("search", vary=["coating.specularity"], **given)
    assert wrong["kind"] == "SearchError"
    wrong = engine.refused("search", vary=["coating.specularity=0:1"], method="luck", **given)
    assert wrong["kind"] == "SearchError"
    assert not study.exists()
    assert engine.refused("watch", study=str(study))["kind"] == "SearchError"
    assert engine.refused("watch", study="relative")["where"] == "study"
    rows = engine.ask("space", design="gelsight-mini-ideal", vary=["coating.specularity=0:1"])
    assert [(p["name"], p["lower"], p["upper"]) for p in rows["parameters"]] == [
        ("coating.specularity", 0, 1)
    ]


def test_what_a_search_is_worth_is_told_before(engine: Any) -> None:
    asked = {"design": "gelsight-mini-ideal", "objectives": ["aoap"]}
    bright = engine.ask("advise", vary=["coating.specularity=0:1"], budget=60, **asked)
    assert "score alike" in bright["advice"] and bright["fitting"] == ["rgb2normal", "normdiff"]
    view = engine.ask("advise", vary=["camera.fov=50:60"], **asked)
    assert view["advice"] is None and view["fitting"] == [] and view["trials"] > 1
    twice = engine.ask("advise", vary=["camera.fov=50:60"], budget=2 * view["trials"], **asked)
    assert twice["seconds"] > view["seconds"] > 0.0


def test_a_search_in_which_everything_fails_says_why(engine: Any, tmp_path: Path) -> None:
    file = tmp_path / "fails.py"
    file.write_text("def fails(evaluation):\n    raise ValueError('no luck')\n")
    error = engine.refused(
        "search",
        design="gelsight-mini-ideal",
        study=str(tmp_path / "study"),
        vary=["coating.specularity=0:1:9"],
        objectives=[f"{file}:fails"],
        method="grid",
    )
    assert error["kind"] == "SearchError" and "no luck" in error["message"]


def test_a_search_that_is_stopped_before_it_has_begun_says_so(
    engine: Any, tmp_path: Path, goal: str
) -> None:
    study = tmp_path / "study"
    number = engine.send(
        "search",
        design="gelsight-mini-ideal",
        study=str(study),
        vary=["coating.specularity=0:1"],
        objectives=[goal],
        method="random",
        budget=1,
    )
    engine.result(number)
    (tmp_path / "hold").touch()
    command = [sys.executable, "-m", "optisense.engine.searcher", str(study), "--budget", "99"]
    ignoring = ["sh", "-c", 'trap "" INT; exec "$@"', "sh"]  # as a shell does in the background
    # Asked, or whoever would ask has gone.
    for told, shell in ((b"stop\n", []), (b"", []), (b"stop\n", ignoring)):
        ended = subprocess.run([*shell, *command], input=told, capture_output=True, check=False)
        assert ended.returncode == 0, ended.stderr.decode()
        assert json.loads(ended.stdout)["interrupted"]


@pytest.mark.slow
def test_a_cancelled_search_keeps_its_trials_and_goes_on_later(
    engine: Any, tmp_path: Path, goal: str, hold: Path
) -> None:
    study = str(tmp_path / "study")
    number = engine.send(
        "search",
        design="gelsight-mini-ideal",
        study=study,
        vary=["coating.specularity=0:1:100"],
        objectives=[goal],
        method="grid",
    )
    engine.until(lambda m: m["id"] == number and m.get("event") == "trial" and m["done"] >= 1)
    assert engine.ask("study", study=study)["running"]
    busy = engine.refused("resume", study=study)
    assert busy["kind"] == "FolderInUseError" and "another process" in busy["message"]
    assert engine.ask("cancel", of=number) == {"cancelled": True}
    stopped = engine.result(number)
    assert stopped["interrupted"] and 1 <= stopped["done"] < 100
    hold.unlink()
    again = engine.send("resume", study=study)
    assert engine.result(again)["done"] == 100
    assert not engine.ask("study", study=study)["running"]


def test_what_a_search_does_before_and_after_its_trials_is_said(
    engine: Any, tmp_path: Path
) -> None:
    """The search goes on to its next step when the present one has been said."""
    file = tmp_path / "goal.py"
    file.write_text(TICKETS)
    tickets = tmp_path / "tickets"
    tickets.mkdir()
    number = engine.send(
        "search",
        design="gelsight-mini-ideal",
        study=str(tmp_path / "study"),
        vary=["coating.specularity=0:1:2"],
        objectives=[f"{file}:shine"],
        method="grid",
    )
    steps = (("scoring this sensor", 1), ("of 2 trials", 2), ("scoring the best again", 0))
    for text, scores in steps:
        engine.until(
            lambda m, text=text: (
                m["id"] == number and m.get("event") == "progress" and text in m["text"]
            )
        )
        for score in range(scores):
            (tickets / f"{text}-{score}").touch()
    tickets.rename(tmp_path / "needless")
    assert engine.result(number)["done"] == 2


def test_more_trials_than_at_first_are_counted_to_the_new_number(
    engine: Any, tmp_path: Path, goal: str
) -> None:
    study = str(tmp_path / "study")
    fields = {"vary": ["coating.specularity=0:1"], "objectives": [goal], "method": "random"}
    first = engine.send("search", design="gelsight-mini-ideal", study=study, budget=2, **fields)
    assert engine.result(first)["done"] == 2
    again = engine.send("resume", study=study, budget=4)
    assert engine.result(again)["done"] == 4
    assert engine.event(again, "begun")["budget"] == 4
    told = engine.events(again, "progress")
    assert {each["total"] for each in told} == {4}
    assert told[-1]["fraction"] == 1.0 and told[-1]["text"] == "4 of 4 trials"


@pytest.mark.slow
def test_a_search_ends_with_the_engine_or_outlives_it(
    start: Callable[..., Any],
    tmp_path: Path,
    goal: str,
    hold: Path,
    wait_until_gone: Callable[[int], None],
) -> None:
    client = start()
    numbers = {}
    for go_on in (False, True):
        numbers[go_on] = client.send(
            "search",
            design="gelsight-mini-ideal",
            study=str(tmp_path / f"study-{go_on}"),
            vary=["coating.specularity=0:1:500"],
            objectives=[goal],
            method="grid",
            go_on=go_on,
        )
    for number in numbers.values():
        client.event(number, "trial")
    processes = {key: client.event(n, "begun")["pid"] for key, n in numbers.items()}
    client.process.kill()
    wait_until_gone(processes[False])
    os.kill(processes[True], 0)  # it is there
    later = start()
    seen = later.send("watch", study=str(tmp_path / "study-True"))
    later.until(lambda m: m["id"] == seen and m.get("event") == "trial" and m["done"] >= 3)
    assert later.ask("stop", study=str(tmp_path / "study-True")) == {"stopped": True}
    assert later.result(seen)["interrupted"]
    wait_until_gone(processes[True])
    assert later.ask("stop", study=str(tmp_path / "study-True")) == {"stopped": False}
