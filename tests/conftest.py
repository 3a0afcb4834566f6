"""Fixtures of all tests."""

from __future__ import annotations

import gc
import signal
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
import warm_python

# A shell that starts a program in the background lets it ignore Ctrl-C, and so do the programs that
# it starts. Tests press Ctrl-C.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_collection_finish() -> None:
    """Leave the modules and the tests themselves out of the garbage collections of the tests."""
    gc.collect()
    gc.freeze()


@pytest.fixture(autouse=True, scope="session")
def _nothing_of_the_user(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Keep the library and the state folder of whoever runs the tests out of them."""
    folder: Path = tmp_path_factory.getbasetemp()
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("OPTISENSE_LIBRARY", str(folder / "no-own-library"))
        patch.setenv("XDG_STATE_HOME", str(folder / "state"))
        yield


@pytest.fixture
def forks(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let programs that are started by `sys.executable` be forks of one warm process."""
    monkeypatch.setattr(sys, "executable", str(warm_python.programs() / "python"))
