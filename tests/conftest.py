"""What holds for all tests."""

from __future__ import annotations

import signal
from pathlib import Path

import pytest

# A shell that starts a program in the background lets it ignore Ctrl-C, and so do the programs that
# it starts. Tests press Ctrl-C.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(autouse=True)
def _no_own_library(
    monkeypatch: pytest.MonkeyPatch, tmp_path_factory: pytest.TempPathFactory
) -> None:
    """Keep the library of whoever runs the tests out of them."""
    folder: Path = tmp_path_factory.getbasetemp() / "no-own-library"
    monkeypatch.setenv("OPTISENSE_LIBRARY", str(folder))
