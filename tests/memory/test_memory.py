"""Memory and open files of one process stay bounded, however much it does.

`make memory-tests` does the same hundreds of times. Each runs in a process of its own, so that
others leave nothing in it.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import drjit as dr
import pytest

import optisense as ots
from optisense.optics.backend import memory

from .work import wrong

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")


@pytest.mark.slow
@pytest.mark.parametrize(("work", "times"), [("images", 14), ("scores", 14), ("files", 10)])
def test_work_done_again_takes_no_more_memory(work: str, times: int) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "tests.memory", work, "--times", str(times)],
        capture_output=True,
        text=True,
        cwd=Path(__file__).parents[2],
    )
    assert done.returncode == 0, done.stdout + done.stderr


def test_growth_is_found() -> None:
    steady = [(n, 300.0, 6) for n in range(1, 20)]
    assert wrong("images", steady) == ""
    assert "MiB more" in wrong("images", [(n, 300.0 + 5 * n, 6) for n in range(1, 20)])
    assert wrong("files", [*steady, (20, 300.0, 7)]) == "files stay open"
    assert "more than 3600" in wrong("designs", [*steady, (20, 3700.0, 6)])
    assert wrong("scores", steady[:3]) == "too few rounds to tell"


@pytest.mark.slow
def test_what_one_model_has_freed_is_given_back_before_the_next(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Where a process takes up more than the bound, which here is anything at all."""
    flushed: list[float] = []
    monkeypatch.setattr(memory, "MOST_RESIDENT", 0)
    monkeypatch.setattr(memory, "LEAST_FREED", -float("inf"))
    monkeypatch.setattr(memory._Bound, "resident", 0)
    flush = dr.flush_malloc_cache

    def noted() -> None:
        before = memory.resident()
        flush()
        flushed.append(before - memory.resident())

    monkeypatch.setattr(memory.dr, "flush_malloc_cache", noted)
    for _ in range(2):
        model = ots.OpticalModel(ots.load("gelsight-mini-ideal"), "llvm")
        model.render([], (24, 18), 3000)
    assert len(flushed) == 2
    assert flushed[1] > 50 * 2**20
