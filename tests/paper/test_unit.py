"""Units are worked out once: after a break, by another process, and whatever their order."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from warm_python import programs

from optisense.errors import ObjectiveError, SetupError
from paper import Bench, Found, Unit
from paper.evaluations import scores, sensor
from paper.unit import UNITS, ExperimentError, kept

asked: list[Any] = []
stop_at: set[Any] = set()


def square(inputs: Mapping[str, Any], folder: Path) -> Found:
    """The work of these tests."""
    asked.append(inputs["x"])
    if inputs["x"] in stop_at:
        raise KeyboardInterrupt
    if inputs["x"] < 0:
        raise ObjectiveError("x is below 0")
    picture = np.full((2, 3, 3), inputs["x"], dtype=np.uint8)
    return Found({"square": inputs["x"] ** 2}, {"picture": picture})


def no_renderer(inputs: Mapping[str, Any], folder: Path) -> Found:
    """A machine without libLLVM."""
    raise SetupError("no libLLVM")


def units(*values: int) -> list[Unit]:
    return [Unit(square, {"x": x}, f"square of {x}") for x in values]


@pytest.fixture(autouse=True)
def _nothing_asked() -> None:
    asked.clear()
    stop_at.clear()


def test_records_come_in_the_order_of_units_with_pictures(tmp_path: Path) -> None:
    records = Bench(tmp_path).run(units(3, 1, 2))
    assert [record.values["square"] for record in records] == [9, 1, 4]
    assert [int(record.pictures()["picture"].max()) for record in records] == [3, 1, 2]


def test_a_stopped_run_goes_on_and_asks_nothing_twice(tmp_path: Path) -> None:
    stop_at.add(3)
    with pytest.raises(KeyboardInterrupt):
        Bench(tmp_path).run(units(1, 2, 3, 4))
    stop_at.clear()
    asked.clear()
    records = Bench(tmp_path).run(units(1, 2, 3, 4))
    assert asked == [3, 4]
    assert [record.values["square"] for record in records] == [1, 4, 9, 16]


def test_the_same_question_of_two_experiments_is_asked_once(tmp_path: Path) -> None:
    Bench(tmp_path).run([*units(5), Unit(square, {"x": 5}, "the same under another label")])
    Bench(tmp_path).run([Unit(square, {"x": 5}, "and another", alone=True)])
    assert asked == [5]


def test_another_input_or_release_is_another_question(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    Bench(tmp_path).run(units(5))
    Bench(tmp_path).run(units(6))
    monkeypatch.setattr("paper.unit.__version__", "another")
    Bench(tmp_path).run(units(5))
    assert asked == [5, 6, 5]


def test_a_failure_of_the_users_kind_is_a_gap_and_is_kept(tmp_path: Path) -> None:
    first, second = (Bench(tmp_path).run(units(-1))[0] for _ in range(2))
    assert first.failure == second.failure == "x is below 0"
    assert asked == [-1]


def test_a_machine_that_cannot_render_is_no_gap(tmp_path: Path) -> None:
    unit = Unit(no_renderer, {}, "nothing")
    with pytest.raises(SetupError):
        Bench(tmp_path).run([unit])
    assert kept(unit, tmp_path) is None


def test_a_broken_file_is_named(tmp_path: Path) -> None:
    (unit,) = units(1)
    Bench(tmp_path).run([unit])
    (tmp_path / UNITS / f"{unit.key}.json").write_text("{", encoding="utf-8")
    with pytest.raises(ExperimentError, match=unit.key):
        Bench(tmp_path).run([unit])


def rays(width: int) -> Unit:
    settings = {"ray_resolution": [width, width]}
    inputs = {"design": sensor("gelsight-mini-ideal"), "objectives": ["aoap"], "settings": settings}
    return Unit(scores, inputs, f"rays {width}")


@pytest.mark.slow
def test_processes_find_the_same_as_one(tmp_path: Path) -> None:
    several = [rays(8), rays(12), rays(16)]
    one = Bench(tmp_path / "one").run(several)
    two = Bench(tmp_path / "two", workers=2).run(several)
    assert [r.values for r in one] == [r.values for r in two]
    assert len({record.values["scores"]["aoap"] for record in one}) == 3


KILLED = """
import sys
from pathlib import Path
from paper import Bench, Unit
from paper.evaluations import scores, sensor

def rays(width):
    inputs = {"design": sensor("gelsight-mini-ideal"), "objectives": ["aoap"],
              "settings": {"ray_resolution": [width, width]}}
    return Unit(scores, inputs, "rays")

Bench(Path(sys.argv[1])).run([rays(width) for width in range(8, 208)])
"""


@pytest.mark.slow
def test_what_a_killed_process_had_finished_is_not_done_again(tmp_path: Path) -> None:
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    child = subprocess.Popen([programs() / "python", "-c", KILLED, str(tmp_path)], env=environment)
    home = tmp_path / UNITS
    whole = "[!.]*.json"  # not the one being written, whose name begins with a dot
    while len(list(home.glob(whole))) < 3:
        assert child.poll() is None
        os.sched_yield()
    child.kill()
    child.wait()
    before = {path: path.stat().st_mtime_ns for path in home.glob(whole)}
    assert all(json.loads(path.read_text()) for path in before)
    records = Bench(tmp_path).run([rays(width) for width in range(8, 11)])
    assert all(record.failure is None for record in records)
    assert {path: path.stat().st_mtime_ns for path in before} == before
