"""The commands that are killed, and what of their results must be as if they had not been."""

from __future__ import annotations

import contextlib
import json
import sqlite3
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from optisense.search import Study

ASSETS = Path(__file__).parents[1] / "assets"

GOALS = """
import time

def nearness(evaluation):
    time.sleep(0.02)
    design = evaluation.design
    return -((design.coating.specularity - 0.3) ** 2) - (design.camera.position[0] - 0.5) ** 2

def brightness(evaluation):
    return evaluation.design.coating.specularity
"""

SMALL = ("--photons", "3000", "--resolution", "24x18", "--variant", "llvm")
"""Renders in which nearly all time is compilation."""

NAMES_WITH_TIMES = ("run.json", "report.html", "dataset.json", "trials.sqlite")
"""Files of results that also tell when and how fast they came about."""


@dataclass(frozen=True)
class Work:
    """A command that writes into a folder.

    Attributes:
        words: the command; ``@OUT`` stands for its folder, ``@GOALS`` for a file of objectives.
        again: what is added when it is given once more.
        result: what must be equal of what is in the folder, however often it was killed.
        workers: how many processes of its own the command has.
    """

    words: tuple[str, ...]
    again: tuple[str, ...] = ()
    result: Callable[[Path], Any] = lambda folder: whole_files(folder)
    workers: int = 0


def _search(method: str, objectives: tuple[str, ...], workers: int, *more: str) -> Work:
    second = "camera.position.y=-1:1" if method == "gradient" else "coating.specularity=0:1:5"
    return Work(
        ("search", "gelsight-mini", "--method", method, "--seed", "7", *objectives, *more,
         "--vary", "camera.position.x=-1:3:4",
         "--vary", second,
         "--workers", str(workers), "--out", "@OUT"),
        ("--resume", "--trust"), lambda folder: trials(folder), workers if workers > 1 else 0,
    )  # fmt: skip


NEAR, BRIGHT = ("-b", "@GOALS:nearness"), ("-b", "@GOALS:brightness")
RAYS = ("-b", "aoap", "--set", "ray_resolution=[16,12]")

WORK: dict[str, Work] = {
    "apply": Work(("apply", str(ASSETS / "study-v1"), "--out", "@OUT")),
    "export": Work(("export", "gelsight-mini", "--out", "@OUT")),
    "grid": _search("grid", NEAR, 1, "--budget", "20"),
    "cma-es": _search("cma-es", NEAR, 1, "--budget", "30"),
    "cma-es, 2 workers": _search("cma-es", NEAR, 2, "--budget", "30"),
    "pareto": _search("pareto", NEAR + BRIGHT, 1, "--budget", "30"),
    "pareto, 2 workers": _search("pareto", NEAR + BRIGHT, 2, "--budget", "30"),
    "gradient": _search("gradient", RAYS, 1, "--budget", "12"),
    "dataset": Work(("dataset", "gelsight-mini", "--count", "4", *SMALL, "--out", "@OUT")),
    "render": Work(("render", "gelsight-mini", *SMALL, "--out", "@OUT")),
}


def whole_files(folder: Path) -> dict[str, bytes | None]:
    """What is in the files of a folder by their paths; None for those that tell times, too."""
    return {
        path.relative_to(folder).as_posix(): (
            None if path.name in NAMES_WITH_TIMES else path.read_bytes()
        )
        for path in sorted(folder.rglob("*"))
        if path.is_file() and not _of_the_store(path)
    }


def trials(folder: Path) -> dict[str, Any]:
    """All trials of a study in their order, without times and workers; and the other files."""
    with contextlib.closing(Study.open(folder)) as study:
        rows = [
            (row.number, row.generation, row.place, row.vector.tolist(),
             None if row.outcome is None else json.dumps(dict(row.outcome.scores or {})))
            for row in study.store.rows()
        ]  # fmt: skip
        best = study.best.number
    return {"trials": rows, "best": best, "files": sorted(whole_files(folder))}


def half_files(folder: Path, whole: dict[str, bytes | None]) -> list[str]:
    """Files that look whole and are not, after a kill.

    A file whose name begins with a dot is a temporary one. A table to which lines are added has
    whole lines; any other is as in the result of a command that was not killed.

    Args:
        folder: that the killed command wrote to.
        whole: the files of one that was not killed.
    """
    odd = []
    for path in sorted(folder.rglob("*")):
        name = path.relative_to(folder).as_posix()
        hidden = any(part.startswith(".") for part in path.relative_to(folder).parts)
        if hidden or not path.is_file() or _of_the_store(path):
            continue
        wrong = _wrong(path, whole.get(name, b""))
        if name not in whole or wrong:
            odd.append(f"{name}: {wrong or 'is not in the result'}")
    return odd


def _wrong(path: Path, whole: bytes | None) -> str:
    data = path.read_bytes()
    if path.suffix == ".sqlite":
        with contextlib.closing(sqlite3.connect(path)) as db:
            told = [row[0] for row in db.execute("pragma integrity_check")]
        return "" if told == ["ok"] else str(told)
    if path.suffix == ".csv" and whole is not None:
        return "" if whole.startswith(data) and data.endswith(b"\n") else "has half a line"
    try:
        if path.suffix == ".json":
            json.loads(data)
        elif path.suffix == ".yaml":
            yaml.safe_load(data)
        elif path.suffix == ".npz":
            with np.load(path) as file:
                _ = [file[name] for name in file.files]
    except Exception as error:
        return f"can't be read: {error}"
    if whole is None or path.name == "study.json":
        return "" if path.suffix != ".html" or data.rstrip().endswith(b"</html>") else "is cut off"
    return "" if data == whole else "has other content"


def _of_the_store(path: Path) -> bool:
    """Whether it is SQLite's journal, which belongs to the store beside it."""
    return path.name.endswith(("-wal", "-shm", "-journal"))
