"""What a long command says of itself, on a terminal and in a log."""

from __future__ import annotations

import io
import re

import pytest
from rich.console import Console

from optisense.cli import progress
from optisense.cli.progress import counting_bar


def test_in_a_log_a_line_comes_now_and_then(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = iter([0.0, 10.0, 45.0, 50.0, 80.0])
    monkeypatch.setattr(progress.time, "monotonic", lambda: next(clock))
    log = io.StringIO()
    monkeypatch.setattr(progress, "messages", Console(file=log, width=120))
    with counting_bar("samples") as show:
        for done in range(1, 5):
            show(done, None if done == 4 else 9, f"contact {done}")
    assert log.getvalue().splitlines() == [
        "samples: 2 of 9, 0.8 min, contact 2",
        "samples: 4, 1.3 min, contact 4",
    ]


@pytest.mark.parametrize("left", [True, False])
def test_on_a_terminal_a_bar_counts(monkeypatch: pytest.MonkeyPatch, left: bool) -> None:
    screen = io.StringIO()
    console = Console(file=screen, force_terminal=True, width=120)
    monkeypatch.setattr(progress, "messages", console)
    with counting_bar("samples", left=left, note="getting ready") as show:
        show(3, 9, "contact 3")
    shown = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", screen.getvalue())
    assert "samples" in shown
    assert "getting ready" in shown
    assert "3/9" in shown
    assert "contact 3" in shown
    assert ("left" in shown) == left
