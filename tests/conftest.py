"""What holds for all tests."""

from __future__ import annotations

from pathlib import Path

import pytest


@pytest.fixture(autouse=True)
def _no_own_library(
    monkeypatch: pytest.MonkeyPatch, tmp_path_factory: pytest.TempPathFactory
) -> None:
    """Keep the library of whoever runs the tests out of them."""
    folder: Path = tmp_path_factory.getbasetemp() / "no-own-library"
    monkeypatch.setenv("OPTISENSE_LIBRARY", str(folder))
