"""The examples run as they are, in an empty folder."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest
from warm_python import programs

EXAMPLES = sorted((Path(__file__).parents[1] / "examples").glob("*.py"))


def test_the_examples_are_numbered() -> None:
    assert [file.name[:3] for file in EXAMPLES] == ["01_", "02_", "03_", "04_", "05_"]


@pytest.mark.parametrize("script", EXAMPLES, ids=lambda file: file.stem)
def test_an_example_runs(script: Path, tmp_path: Path) -> None:
    done = subprocess.run(
        [programs() / "python", str(script)], cwd=tmp_path, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip()
