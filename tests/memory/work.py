"""Repeated work, and the memory and open files that it uses."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from pathlib import Path

import optisense as ots
from optisense.objectives import evaluate
from optisense.optics.backend.memory import resident
from optisense.sensors.registry import SENSORS

SLACK = 48.0
"""MiB by which the use of memory may grow after the first rounds, for what is compiled later."""

MOST_IN_USE = 3600.0
"""MiB that a process may take up that goes from sensor to sensor: the 2 GiB from which on freed
memory is given back (`optisense.optics.backend.memory`), and the light of one more sensor."""

FIRST = {"images": 8, "scores": 8, "designs": 7, "files": 5}
"""Rounds of each piece of work until all that is kept is there; of designs, each sensor once."""

RESOLUTION = (24, 18)
"""Size (pixels) of the pictures; it is small, as nearly all memory is used for the light."""

PHOTONS = 3000
"""Photons of the pictures; the memory for their light does not depend on it."""


def images() -> Iterator[None]:
    """Pictures of one sensor with a ball that is another one each time."""
    model = ots.OpticalModel(ots.load("gelsight-mini-ideal"), "llvm")
    number = 0
    while True:
        ball = ots.Sphere(1.0 + 0.001 * (number % 997))
        at = (float(number % 7 - 3), float(number % 5 - 2))
        model.render([ots.Contact(ball, at=at, depth=0.3)], RESOLUTION, PHOTONS)
        number += 1
        yield


def scores() -> Iterator[None]:
    """A score of a design that is another one each time."""
    number = 0
    while True:
        design = ots.load("gelsight-mini-ideal")
        design.camera.position = (0.001 * (number % 997), *design.camera.position[1:])
        evaluate(design, "aoap")
        number += 1
        yield


def designs() -> Iterator[None]:
    """The built-in sensors in turn, each with a picture."""
    while True:
        for name in SENSORS.names():
            model = ots.OpticalModel(ots.load(name), "llvm")
            model.render([], RESOLUTION, PHOTONS)
            yield


def files() -> Iterator[None]:
    """The built-in sensors in turn, saved, opened and checked, with a study and a dataset."""
    from tempfile import TemporaryDirectory

    from optisense.search import Study
    from optisense.tasks.dataset import Dataset

    assets = Path(__file__).parents[1] / "assets"
    while True:
        with TemporaryDirectory() as folder:
            ots.save_design(ots.load("gelsight-mini-ideal"), Path(folder, "design"))
            ots.check(ots.load(Path(folder, "design")))
        study = Study.open(assets / "study-v1")
        assert study.trials
        study.close()
        assert list(Dataset.load(assets / "dataset-v1"))
        yield


WORK: dict[str, Callable[[], Iterator[None]]] = {
    "images": images,
    "scores": scores,
    "designs": designs,
    "files": files,
}


def measured(name: str, times: int) -> Iterator[tuple[int, float, int]]:
    """Do a piece of work so often; after each, its number, the MiB in use and the open files."""
    doing = WORK[name]()
    for number in range(1, times + 1):
        next(doing)
        yield number, resident() / 2**20, len(os.listdir("/proc/self/fd"))  # noqa: PTH208


def wrong(name: str, rows: list[tuple[int, float, int]]) -> str:
    """Return the violations in the rows of `measured`; empty if there are none.

    Memory may not grow by more than `SLACK` after the first rounds, nor beyond `MOST_IN_USE` where
    sensors come in turn; the number of open files may not grow at all.
    """
    later = [row for row in rows if row[0] >= FIRST[name]]
    use = [mebibytes for _, mebibytes, _ in later]
    if not later:
        return "too few rounds to tell"
    if max(files for _, _, files in later) > later[0][2]:
        return "files stay open"
    if name == "designs":
        return f"more than {MOST_IN_USE:.0f} MiB" if max(use) > MOST_IN_USE else ""
    return f"more than {SLACK:.0f} MiB more" if max(use) - use[0] > SLACK else ""
