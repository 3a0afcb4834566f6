"""A study whose process is killed at any moment goes on as if it had not been."""

from __future__ import annotations

import os
import subprocess
import sys
from collections import Counter
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from optisense.design import SensorDesign
from optisense.search import Study, search

SPACE = {"coating.specularity": (0.0, 1.0), "camera.position.x": (-1.0, 3.0)}
BUDGET = 40

SCRIPT = """
import sys
import cheap_goals
import optisense as ots

ots.search.search(
    ots.load("gelsight-mini-ideal"),
    {"coating.specularity": (0.0, 1.0), "camera.position.x": (-1.0, 3.0)},
    cheap_goals.told,
    budget=40,
    seed=7,
    workers=int(sys.argv[2]),
    out=sys.argv[1],
)
"""


def calls(log: Path) -> Counter[tuple[float, float]]:
    """Return the number of calls at each point."""
    lines = [line.split() for line in log.read_text().splitlines()]
    return Counter((float(first), float(second)) for first, second, _ in lines)


@pytest.mark.slow
@pytest.mark.parametrize("workers", [1, 2])
def test_kill_9_amid_a_generation(
    workers: int,
    mini: SensorDesign,
    goals: ModuleType,
    goals_folder: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    request: pytest.FixtureRequest,
) -> None:
    """The 16th call kills the study in the third generation of six (the start comes first)."""
    log, folder = tmp_path / "log", tmp_path / "study"
    monkeypatch.setenv("TRIAL_LOG", str(log))
    if workers == 1:  # a worker that is a fork has another parent than its study
        request.getfixturevalue("forks")
    child = subprocess.run(
        [sys.executable, "-c", SCRIPT, str(folder), str(workers)],
        env={
            **os.environ,
            "PYTHONPATH": os.pathsep.join([str(goals_folder), *filter(None, sys.path)]),
            "KILL_AT": "16",
            "WORKERS": str(workers),
        },
        capture_output=True,
    )
    assert child.returncode == -9, child.stderr.decode()

    left = Study.open(folder)
    rows = left.store.rows()
    done = {tuple(row.vector) for row in rows if row.outcome is not None}
    left.close()
    assert 13 <= len(done) <= 16
    assert len(done) < len(rows)  # it was amid a generation

    request.getfixturevalue("forks")
    before = calls(log)
    result = search(
        mini, SPACE, goals.told, budget=BUDGET, seed=7, workers=workers, out=folder, resume=True
    )
    after = calls(log)
    again = {tuple(trial.vector) for trial in result.trials if trial.fresh}
    assert all(after[place] == before[place] for place in done - again)
    assert not result.notes

    monkeypatch.setenv("TRIAL_LOG", str(tmp_path / "other"))
    whole = search(mini, SPACE, goals.told, budget=BUDGET, seed=7)
    ours, theirs = (
        np.array([row.vector for row in study.store.rows()])
        for study in (result.study, whole.study)
    )
    assert np.array_equal(ours, theirs)
    assert [t.score for t in result.trials] == [t.score for t in whole.trials]
    assert result.best.number == whole.best.number
