"""A terminal keeps its state between commands, as that of a reader does."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from .terminal import Terminal, reader_environment

LIMIT = 300.0
"""Longest time (s) of a command; only one that hangs takes so long."""


@pytest.fixture
def terminal(tmp_path: Path) -> Iterator[Terminal]:
    # The readers' `python` is that of the activated environment; Debian itself has only `python3`.
    python = {"PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"}
    with Terminal(tmp_path, reader_environment(tmp_path / "own") | python) as opened:
        yield opened


def test_exit_code_and_both_outputs_are_told(terminal: Terminal) -> None:
    outcome = terminal.type("echo out; echo err >&2; exit 3", limit=LIMIT)
    assert (outcome.exit_code, outcome.output) == (3, "out\nerr\n")


def test_folder_and_variables_last_as_after_activating(terminal: Terminal, tmp_path: Path) -> None:
    (tmp_path / "sub dir").mkdir()
    (tmp_path / "activate").write_text('A="two words"; export A\n', encoding="utf-8")
    assert terminal.type(". ./activate", limit=LIMIT).exit_code == 0
    assert terminal.type("cd 'sub dir'", limit=LIMIT).exit_code == 0
    outcome = terminal.type('echo "$A in $(basename "$PWD")"', limit=LIMIT)
    assert outcome.output == "two words in sub dir\n"


def test_enter_answers_questions(terminal: Terminal) -> None:
    ask = 'test -t 0 && read -r first && read -r second && echo "[$first$second]"'
    assert terminal.type(ask, enter=True, limit=LIMIT).output == "[]\n"


def test_a_command_that_waits_is_killed_at_its_limit(terminal: Terminal) -> None:
    with pytest.raises(subprocess.TimeoutExpired):
        terminal.type("read -r answer", limit=0.1)
    assert terminal.type("echo alive", limit=LIMIT).output == "alive\n"


def test_python_keeps_its_names_and_shows_the_line_that_fails(terminal: Terminal) -> None:
    assert terminal.type_python("three = 3", "page.md:1", limit=LIMIT).exit_code == 0
    assert terminal.type_python("assert three == 3", "page.md:5", limit=LIMIT).exit_code == 0
    failed = terminal.type_python("a = 1\nassert three == 4, a", "page.md:9", limit=LIMIT)
    assert failed.exit_code == 1
    assert 'File "page.md:9", line 2' in failed.output
    assert "assert three == 4, a" in failed.output


def test_python_that_ends_is_a_failure(terminal: Terminal) -> None:
    failed = terminal.type_python("import os; os._exit(7)", "page.md:1", limit=LIMIT)
    assert (failed.exit_code, failed.output) == (1, "Python ended with 7")


def test_nothing_of_the_test_run_is_in_the_environment(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("PYTHONPATH", "/somewhere")
    monkeypatch.setenv("MAKEFLAGS", "-n")
    environment = reader_environment(tmp_path)
    assert not {"PYTHONPATH", "MAKEFLAGS", "PYTEST_CURRENT_TEST"} & set(environment)
    assert environment["OPTISENSE_LIBRARY"] == str(tmp_path / "library")
