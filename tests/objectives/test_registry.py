"""Finding objectives by name, from a file or an installed package, and what their values mean."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import optisense as ots
from optisense.errors import ObjectiveError
from optisense.objectives import BUILT_IN, find, names
from optisense.objectives.registry import forgetting
from optisense.objectives.score import deviation_of

OWN = '''
import optisense

@optisense.objective("own-depth", title="Own depth")
def own_depth(evaluation, *, factor=2.0):
    """How deep, times a factor."""
    return factor * evaluation.settings.depth

def plain(evaluation):
    return 1.0
'''


@pytest.fixture(autouse=True)
def registry_as_before() -> Iterator[None]:
    with forgetting():
        yield


@pytest.fixture
def own_file(tmp_path: Path) -> Path:
    path = tmp_path / "own.py"
    path.write_text(OWN)
    return path


@pytest.mark.parametrize("name", BUILT_IN)
def test_built_in_objectives_are_found(name: str) -> None:
    assert find(name).name == name
    assert find(name.upper()) is find(name)
    assert name in names()


def test_names_begin_with_the_four_of_the_paper() -> None:
    assert names()[:4] == ["rgb2normal", "normdiff", "aoap", "2to3pw"]


def test_a_file_with_one_objective_needs_no_function_name(own_file: Path) -> None:
    found = find(str(own_file))
    assert found.name == "own-depth"
    assert found.title == "Own depth"
    assert found.settings == {"factor": 2.0}
    assert found.summary == "How deep, times a factor"
    assert find("own-depth") is found


def test_a_function_of_a_file_can_be_named(own_file: Path) -> None:
    assert find(f"{own_file}:own_depth").name == "own-depth"
    assert find(f"{own_file}:plain").name == "plain"


@pytest.mark.parametrize(
    "head",
    [
        "def flux(design):",
        "import optisense\ndef flux(sensor: optisense.SensorDesign):",
        "from __future__ import annotations\ndef flux(sensor: optisense.SensorDesign):",
    ],
)
def test_a_function_of_the_design_in_a_file_is_given_the_design(head: str, tmp_path: Path) -> None:
    path = tmp_path / "mine.py"
    given = "design" if "design" in head else "sensor"
    path.write_text(f"{head}\n    return {given}.lights['red'].flux\n")
    found = find(f"{path}:flux")
    assert found.rays_only
    design = ots.load("gelsight-mini-ideal")
    assert ots.evaluate(design, found).value == design.lights["red"].flux


def test_an_edited_file_is_read_again_even_at_the_same_time_and_size(
    own_file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Python's compiled files tell an edit by these two alone; and no folder is left behind."""
    monkeypatch.setattr("sys.dont_write_bytecode", False)
    before = own_file.stat()
    assert find(str(own_file)).settings == {"factor": 2.0}
    own_file.write_text(OWN.replace("factor=2.0", "factor=3.0"))
    os.utime(own_file, ns=(before.st_atime_ns, before.st_mtime_ns))
    assert own_file.stat().st_size == before.st_size
    assert find(str(own_file)).settings == {"factor": 3.0}
    assert list(own_file.parent.iterdir()) == [own_file]


@pytest.mark.parametrize(
    ("content", "function", "complaint"),
    [
        (None, "", "there is no file"),
        ("def f(:", "", r"not Python.*\.py:1"),
        ("x = 1\nraise ValueError('no')", "", r"ValueError: no.*\.py:2"),
        ("import nowhere_to_be_found", "", "ModuleNotFoundError"),
        ("def contrast(evaluation): return 1", "", "registers 0 objectives"),
        (OWN + OWN.replace("own", "two"), "", "registers 2 objectives"),
        ("def contrast(evaluation): return 1", ":contrats", "Did you mean 'contrast'"),
        ("f = 3", ":f", "no function 'f'"),
        ("def f(): return 1", ":f", "must take an evaluation"),
        ("def f(evaluation, other): return 1", ":f", "must take an evaluation"),
        ("def aoap(evaluation): return 1", ":aoap", "already an objective 'aoap'"),
    ],
)
def test_a_bad_file_says_what_is_wrong(
    content: str | None, function: str, complaint: str, tmp_path: Path
) -> None:
    path = tmp_path / "bad.py"
    if content is not None:
        path.write_text(content)
    with pytest.raises(ObjectiveError, match=complaint):
        find(f"{path}{function}")


def test_running_a_cell_again_replaces_its_own_objective() -> None:
    def cell(value: float) -> Callable[..., float]:
        @ots.objective("again")
        def again(evaluation: Any) -> float:
            return value

        return again

    cell(1.0)
    second = cell(2.0)
    assert find("again").function is second


@pytest.fixture
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A package with entry points, as an installer leaves it on the path."""
    (tmp_path / "sensor_scores.py").write_text(OWN)
    info = tmp_path / "sensor_scores-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: sensor-scores\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(
        "[optisense.objectives]\n"
        "own-depth = sensor_scores:own_depth\n"
        "plain-one = sensor_scores:plain\n"
    )
    monkeypatch.syspath_prepend(str(tmp_path))
    return tmp_path


def test_an_installed_package_brings_its_objectives(installed: Path) -> None:
    assert {"own-depth", "plain-one"} <= set(names())
    assert find("own-depth").title == "Own depth"
    assert find("plain-one").function.__name__ == "plain"


def test_what_is_registered_meanwhile_is_forgotten(tmp_path: Path) -> None:
    """Another file may then take the name; what was there before stays."""
    text = OWN.replace("own-depth", "passing")
    files = [tmp_path / "one.py", tmp_path / "two.py"]
    for file in files:
        file.write_text(text)
        with forgetting():
            assert find(f"{file}:own_depth").name == "passing"
            assert "passing" in names()
        assert "passing" not in names()
    assert find("aoap").title == "AOAP"


BY_RAYS = ("aoap", "2to3pw", "coverage", "distortion")
ENDS = ("gelsight-svelte", "gelsight360", "gelbelt", "gelsight-mini-ideal-spherical")
"""The built-in sensors among which the poorest and the best of each objective are."""


def test_poor_and_good_are_the_ends_of_the_built_in_sensors() -> None:
    found = {each: ots.evaluate(ots.load(each), BY_RAYS) for each in ENDS}
    for name in BY_RAYS:
        objective = find(name)
        assert objective.usual is not None
        sign = -1.0 if objective.lower_is_better else 1.0
        values = sorted(sign * scores[name].value for scores in found.values())
        poor, good = (sign * value for value in objective.usual)
        assert values[0] == pytest.approx(poor, rel=0.03), name
        assert values[-1] == pytest.approx(good, rel=0.03), name


def test_what_is_usual_lies_in_the_range_and_in_its_order() -> None:
    for name in names():
        objective = find(name)
        low, high = objective.bounds()
        if objective.usual is not None:
            poor, good = objective.usual
            assert (poor > good) == objective.lower_is_better
            assert low <= min(poor, good) < max(poor, good) <= high


def test_equal_values_do_not_spread() -> None:
    assert np.std([0.1, 0.1, 0.1], ddof=1) > 0.0  # what NumPy says
    assert deviation_of([0.1, 0.1, 0.1]) == 0.0
    assert deviation_of([1.0, 1.0 + 1e-15, 1.0 - 1e-15]) == 0.0
    assert deviation_of([0.0, 0.0]) == 0.0


def test_others_do() -> None:
    assert deviation_of([1.0, 3.0]) == pytest.approx(math.sqrt(2.0))
    assert deviation_of([1.0, 1.00001]) == pytest.approx(7.071e-6, rel=1e-3)
    assert math.isnan(deviation_of([1.0]))
    assert math.isnan(deviation_of([]))
