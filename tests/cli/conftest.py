"""Fixtures of the tests of commands."""

from __future__ import annotations

import math

import pytest


@pytest.fixture(autouse=True)
def _no_lines_of_progress(monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest) -> None:
    """What a command prints must not depend on how long it takes; some tests ask for the lines."""
    if request.path.name != "test_progress.py":
        monkeypatch.setattr("optisense.cli.progress.LOG_EVERY", math.inf)
