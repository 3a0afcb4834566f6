"""The commands that are killed, and the results that a kill must not change."""

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

import optisense as ots
from optisense.calibration import photograph_model, save_photographs
from optisense.report.calibration import RENDERINGS
from optisense.search import Study

from .agreement import agrees

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

PLACES = [(-4.0, 2.0), (3.0, -2.0), (0.5, 3.0), (-1.0, -3.0)]
"""Surface coordinates (mm) of the presses in photographs."""

NAMES_WITH_TIMES = ("run.json", "report.html", "dataset.json", "trials.sqlite")
"""Files of results that also tell when and how fast they came about."""

FITTED = ("design.yaml", "calibration.json", "calibration.html")
"""Files of a fit, whose numbers differ in their last digits: threads add up light in any order."""


@dataclass(frozen=True)
class Work:
    """A command that writes into a folder.

    Attributes:
        words: the command; ``@OUT`` stands for its folder, ``@GOALS`` for a file of objectives.
        again: what is added when it is given once more.
        result: what must be equal of what is in the folder, however often it was killed.
        workers: how many processes of its own the command has.
        cluster: whether a Dask worker works its trials out, and is killed in turn with the command;
            ``@CLUSTER`` stands for the address of the scheduler.
        prepare: makes what the command reads, in the folder that it runs in.
        varying: names of files whose content is another one each time, so only its form counts.
        fits: whether the numbers of its result are fitted, and so depend on rounding.
        share: of the kills, relative to others; commands that take long get fewer.
    """

    words: tuple[str, ...]
    again: tuple[str, ...] = ()
    result: Callable[[Path], dict[str, Any]] = lambda folder: whole_files(folder)
    workers: int = 0
    cluster: bool = False
    prepare: Callable[[Path], None] = lambda home: None
    varying: tuple[str, ...] = NAMES_WITH_TIMES
    fits: bool = False
    share: float = 1.0


def _search(method: str, objectives: tuple[str, ...], workers: int, *more: str) -> Work:
    second = "camera.position.y=-1:1" if method == "gradient" else "coating.specularity=0:1:5"
    cluster = "--cluster" in more
    return Work(
        ("search", "gelsight-mini-ideal", "--method", method, "--seed", "7", *objectives, *more,
         "--vary", "camera.position.x=-1:3:4",
         "--vary", second,
         *(() if cluster else ("--workers", str(workers))), "--out", "@OUT"),
        ("--resume", "--trust"), lambda folder: trials(folder), workers if workers > 1 else 0,
        cluster,
    )  # fmt: skip


NEAR, BRIGHT = ("-b", "@GOALS:nearness"), ("-b", "@GOALS:brightness")
CLUSTER = ("--cluster", "@CLUSTER")
RAYS = ("-b", "aoap", "--set", "ray_resolution=[16,12]")

WORK: dict[str, Work] = {
    "apply": Work(("apply", str(ASSETS / "study-v1"), "--out", "@OUT")),
    "export": Work(("export", "gelsight-mini-ideal", "--out", "@OUT")),
    "grid": _search("grid", NEAR, 1, "--budget", "20"),
    "grid, 2 workers": _search("grid", NEAR, 2, "--budget", "20"),
    "grid, Dask": _search("grid", NEAR, 1, "--budget", "20", *CLUSTER),
    "cma-es": _search("cma-es", NEAR, 1, "--budget", "30"),
    "cma-es, 2 workers": _search("cma-es", NEAR, 2, "--budget", "30"),
    "cma-es, Dask": _search("cma-es", NEAR, 1, "--budget", "30", *CLUSTER),
    "pareto": _search("pareto", NEAR + BRIGHT, 1, "--budget", "30"),
    "pareto, 2 workers": _search("pareto", NEAR + BRIGHT, 2, "--budget", "30"),
    "gradient": _search("gradient", RAYS, 1, "--budget", "12"),
    "gradient, 2 workers": _search("gradient", RAYS, 2, "--budget", "12"),
    "dataset": Work(
        ("dataset", "gelsight-mini-ideal", "--count", "4", *SMALL, "--parquet", "--out", "@OUT"),
        share=0.7,
    ),
    "render": Work(("render", "gelsight-mini-ideal", *SMALL, "--out", "@OUT")),
    "calibrate": Work(
        (
            "calibrate",
            "gelsight-mini-ideal",
            "photographs",
            "--as-labelled",
            "--keep",
            "view",
            "--rounds",
            "1",
            "--photons",
            "3000",
            "--variant",
            "llvm",
            "--out",
            "@OUT",
        ),
        result=lambda folder: fit(folder),
        prepare=lambda home: photograph(home / "photographs"),
        varying=FITTED,
        fits=True,
        share=0.7,
    ),
}


def photograph(folder: Path) -> None:
    """Make photographs of a sensor that is a little unlike the built-in one."""
    design = ots.load("gelsight-mini-ideal")
    design.lights["red"].flux *= 1.2
    balls = [ots.Contact(ots.Sphere(3.0), at=place, depth=0.6) for place in PLACES]
    model = ots.OpticalModel(design, "llvm")
    save_photographs(
        folder, photograph_model(model, balls, resolution=(48, 36), photons=20_000, seed=5)
    )


def whole_files(
    folder: Path, varying: tuple[str, ...] = NAMES_WITH_TIMES
) -> dict[str, bytes | None]:
    """What is in the files of a folder by their paths; None for those that vary."""
    return {
        path.relative_to(folder).as_posix(): (None if path.name in varying else path.read_bytes())
        for path in sorted(folder.rglob("*"))
        if path.is_file() and not _of_the_store(path)
    }


def fit(folder: Path) -> dict[str, Any]:
    """The design that was fitted, and which values and files there are besides."""
    told = json.loads((folder / "calibration.json").read_text(encoding="utf-8"))
    design = ots.load(folder).model_dump(mode="json", exclude={"provenance"})
    return {"files": sorted(whole_files(folder)), "design": design, "told": sorted(told)}


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
    """Return incomplete files under final names after a kill.

    A file whose name begins with a dot is a temporary one. Renderings that a calibration keeps must
    be whole. A table to which lines are added has
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
        kept = path.parent.name == RENDERINGS  # for the next run, until the calibration has ended
        wrong = _wrong(path, None if kept else whole.get(name, b""))
        if wrong or (name not in whole and not kept):
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
    return "" if agrees(path.name, data, whole) else "has other content"


def _of_the_store(path: Path) -> bool:
    """Whether it is SQLite's journal, which belongs to the store beside it."""
    return path.name.endswith(("-wal", "-shm", "-journal"))
