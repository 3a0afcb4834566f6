"""`make lint` judges the project's own folders, and no file that a user keeps beside them."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
WRONG = "import os\nx = {\n"


def test_files_of_a_user_in_the_clone_are_left_alone(tmp_path: Path) -> None:
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    for name in ("rules.py", "mine/objective.py", "notebook.ipynb", "optisense/part.py"):
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(WRONG)
    for command in (["check", "."], ["format", "--check", "."]):
        done = subprocess.run(
            [sys.executable, "-m", "ruff", *command, "--no-cache"],
            cwd=tmp_path,
            capture_output=True,
            text=True,
        )
        said = done.stdout + done.stderr
        assert done.returncode != 0
        assert "part.py" in said
        assert not any(name in said for name in ("rules.py", "objective.py", "notebook"))


def test_every_folder_with_python_files_of_the_project_is_judged() -> None:
    shown = subprocess.run(
        [sys.executable, "-m", "ruff", "check", "--show-files", "."],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    ).stdout.splitlines()
    judged = {Path(line).relative_to(ROOT).parts[0] for line in shown}
    folders = {"benchmarks", "docs", "optisense", "paper", "scripts", "studio", "tests"}
    assert judged == folders | {"pyproject.toml"}
