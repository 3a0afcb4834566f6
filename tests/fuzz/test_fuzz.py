"""Malformed input of every kind is refused in words, or read; `make fuzz` looks for longer."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import HealthCheck, Phase, given, settings

from .cases import FOUND, Case, keep_case, kept_cases, read_case
from .engine_kind import ENGINE
from .every_kind import KINDS
from .kinds import WHOLE
from .runner import one_case

SECONDS = 1.0
"""Wall time for each kind of input, in which some 12 cases are tried."""

MOST_CASES = 15
"""Cases of a kind, in case that this machine is quick."""


@pytest.fixture(scope="module", autouse=True)
def _end_of_the_engine() -> Iterator[None]:
    yield
    ENGINE.end()


@pytest.mark.parametrize("kind", sorted(KINDS))
def test_malformed_input_is_refused_in_words(
    kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    began = time.monotonic()
    tried = 0
    wrong: dict[str, Path] = {}

    @settings(
        max_examples=MOST_CASES,
        deadline=None,
        database=None,
        derandomize=True,
        phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
    )
    @given(KINDS[kind].cases)
    def attempt(case: Case) -> None:
        nonlocal tried
        if tried and time.monotonic() - began > SECONDS:
            return
        tried += 1
        outcome = one_case(kind, case, tmp_path / "case")
        if outcome not in ("read", "refused", *wrong):
            wrong[outcome] = keep_case(kind, case, tmp_path / "found")

    attempt()
    assert tried
    assert not wrong


KEPT = [(kind, folder) for kind in sorted(KINDS) for folder in kept_cases(kind)]


@pytest.mark.parametrize(
    ("kind", "folder"), KEPT, ids=[f"{kind}-{folder.name}" for kind, folder in KEPT]
)
def test_what_was_found_once_is_refused_in_words(
    kind: str, folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert one_case(kind, read_case(folder), tmp_path / "case") in ("read", "refused")


@pytest.mark.parametrize("kind", sorted(WHOLE))
def test_what_is_spoilt_can_be_read_before(kind: str, tmp_path: Path) -> None:
    """Valid cases are accepted, so that damaged ones are refused for their damage alone."""
    assert one_case(kind, WHOLE[kind], tmp_path / "case") == "read"


def test_each_kept_case_is_of_a_kind() -> None:
    assert {path.name for path in FOUND.iterdir()} <= set(KINDS)
    assert KEPT
