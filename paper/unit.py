"""Units: single evaluations of experiments, each computed once and kept in a file.

The name of the file is a fingerprint of the unit's inputs, so that the same unit is never computed
twice: not after an interruption, nor by another experiment, nor when settings are changed and
changed back.
"""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from optisense import __version__
from optisense.errors import OptiSenseError, OutputError, SetupError
from optisense.json_values import json_ready
from optisense.search.study.settings import package_versions
from optisense.writing import inside, write_json, written_together

UNITS = "units"
"""Name of the folder of the units' results, within the folder of all results."""


class ExperimentError(OptiSenseError):
    """An experiment that is unknown, or whose results can't be read."""


@dataclass(frozen=True)
class Found:
    """Result of a unit's work.

    Attributes:
        values: plain values for JSON.
        pictures: pictures (h, w, 3) uint8 by name.
    """

    values: Mapping[str, Any]
    pictures: Mapping[str, NDArray[np.uint8]] = field(default_factory=dict)


Work = Callable[[Mapping[str, Any], Path], Found]
"""Function that computes a unit from plain values and a folder of its own.

The folder may hold the first part of interrupted work, which the function continues; the result is
the same as without the interruption.
"""


@dataclass(frozen=True)
class Unit:
    """One evaluation.

    Attributes:
        work: function of a module, which other processes can import by its name.
        inputs: all inputs, as plain values for JSON.
        label: name in the progress line and in the list of failures.
        alone: whether no other unit may run at the same time, because this one measures time.
    """

    work: Work
    inputs: Mapping[str, Any]
    label: str
    alone: bool = False

    @property
    def key(self) -> str:
        """Return the name of its file: the function, and a fingerprint of inputs and releases."""
        asked = [self.work.__name__, json_ready(self.inputs), __version__, package_versions()]
        text = json.dumps(asked, sort_keys=True)
        return f"{self.work.__name__}-{hashlib.sha256(text.encode()).hexdigest()[:16]}"


@dataclass(frozen=True)
class Record:
    """Kept result of a unit.

    Attributes:
        label: label of the unit.
        values: its results; empty if it failed.
        failure: reason of a failure, or None.
        seconds, processor_seconds: wall time and processor time of all threads, s.
        pictures_file: file of its pictures, or None.
    """

    label: str
    values: Mapping[str, Any]
    failure: str | None
    seconds: float
    processor_seconds: float
    pictures_file: Path | None = None

    def score(self, name: str) -> float | None:
        """Return the score of an objective; None if it has none."""
        found: float | None = self.values.get("scores", {}).get(name)
        return found

    def pictures(self) -> dict[str, NDArray[np.uint8]]:
        """Return the pictures (h, w, 3) uint8 by name."""
        if self.pictures_file is None:
            return {}
        with np.load(self.pictures_file) as stored:
            return {name: stored[name] for name in stored.files}


def kept(unit: Unit, folder: Path) -> Record | None:
    """Return the kept result of a unit, or None.

    Args:
        unit: the unit.
        folder: folder of all results.

    Raises:
        ExperimentError: the unit's file can't be read.
    """
    path = folder / UNITS / f"{unit.key}.json"
    if not path.is_file():
        return None
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
        pictures = path.with_suffix(".npz") if data["pictures"] else None
        return Record(
            unit.label,
            data["values"],
            data["failure"],
            data["seconds"],
            data["processor_seconds"],
            pictures,
        )
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise ExperimentError(
            f"a kept result can't be read: {error}", where=str(path), hint="Delete this file"
        ) from error


def work_out(unit: Unit, folder: Path) -> None:
    """Compute a unit and write its result; a result is written completely or not at all.

    An error that a user can cause, such as an overexposed contact, is a result, too: a failure with
    its reason.

    Raises:
        SetupError: the renderer can't run on this machine.
        OutputError: the result can't be written.
    """
    home = folder / UNITS
    own = inside(folder, f"{UNITS}/{unit.key}")
    began, spent = time.perf_counter(), time.process_time()
    failure, found = None, Found({})
    try:
        own.mkdir(exist_ok=True)
        found = unit.work(unit.inputs, own)
    except (SetupError, OutputError):
        raise
    except OptiSenseError as error:
        failure = str(error)
    record = {
        "asked": {"work": unit.work.__name__, "inputs": unit.inputs},
        "label": unit.label,
        "values": found.values,
        "failure": failure,
        "seconds": round(time.perf_counter() - began, 3),
        "processor_seconds": round(time.process_time() - spent, 3),
        "pictures": sorted(found.pictures),
    }
    path = home / f"{unit.key}.json"
    with written_together("a result") as stage:  # renamed in this order
        if found.pictures:
            pictures: dict[str, Any] = dict(found.pictures)
            np.savez_compressed(stage(path.with_suffix(".npz")), **pictures)
        write_json(stage(path), json_ready(record))
    if not any(own.iterdir()):
        own.rmdir()
