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

SLACK = 48.0
"""MiB by which the use of memory may grow after the first rounds, for what is compiled later."""

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")


@pytest.mark.slow
@pytest.mark.parametrize(("work", "times", "first"), [("images", 18, 8), ("files", 14, 5)])
def test_work_done_again_takes_no_more_memory(work: str, times: int, first: int) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "tests.memory", work, "--times", str(times)],
        capture_output=True,
        text=True,
        cwd=Path(__file__).parents[2],
    )
    assert done.returncode == 0, done.stderr
    rows = [line.split() for line in done.stdout.splitlines()[1:]]
    later = [row for row in rows if int(row[0]) >= first]
    assert len(later) > 5
    use = [float(row[1]) for row in later]
    assert use[-1] - use[0] < SLACK, done.stdout
    assert len({row[2] for row in later}) == 1, done.stdout


@pytest.mark.slow
def test_what_one_model_has_freed_is_given_back_before_the_next(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Where a process takes up more than the bound, which here is anything at all."""
    flushed: list[float] = []
    monkeypatch.setattr(memory, "MOST_RESIDENT", 0)
    flush = dr.flush_malloc_cache

    def noted() -> None:
        before = memory.resident()
        flush()
        flushed.append(before - memory.resident())

    monkeypatch.setattr(memory.dr, "flush_malloc_cache", noted)
    for _ in range(2):
        model = ots.OpticalModel(ots.load("gelsight-mini"), "llvm")
        model.render([], (24, 18), 3000)
    assert len(flushed) == 2
    assert flushed[1] > 50 * 2**20
