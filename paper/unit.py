"""Units: the single evaluations that experiments are made of, each worked out once and kept.

What a unit finds is written to a file whose name is a fingerprint of what was asked, so that the
same question is never worked out twice: not after a break, nor by another experiment, nor when
settings were changed and changed back.
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
from optisense.objectives.score import json_ready
from optisense.search.study.settings import package_versions
from optisense.writing import inside, write_json, written_together
from paper.errors import ExperimentError

UNITS = "units"
"""Folder, within that of all results, of what units found."""


@dataclass(frozen=True)
class Found:
    """What a unit's work returns.

    Attributes:
        values: ready for JSON.
        pictures: (h, w, 3) uint8 by name.
    """

    values: Mapping[str, Any]
    pictures: Mapping[str, NDArray[np.uint8]] = field(default_factory=dict)


Work = Callable[[Mapping[str, Any], Path], Found]
"""Answers a question, given as plain values. The folder is its own and may hold work half done,
from which it goes on; it must find the same then as in one go."""


@dataclass(frozen=True)
class Unit:
    """One question.

    Attributes:
        work: a function of a module, which other processes can find by its name.
        inputs: the whole question, ready for JSON.
        label: how progress and gaps call it.
        alone: whether nothing else may run beside it, because it measures time.
    """

    work: Work
    inputs: Mapping[str, Any]
    label: str
    alone: bool = False

    @property
    def key(self) -> str:
        """The name of its file: work and fingerprint of the question and the releases used."""
        asked = [self.work.__name__, json_ready(self.inputs), __version__, package_versions()]
        text = json.dumps(asked, sort_keys=True)
        return f"{self.work.__name__}-{hashlib.sha256(text.encode()).hexdigest()[:16]}"


@dataclass(frozen=True)
class Record:
    """What came of a unit.

    Attributes:
        label: the unit's.
        values: what it found; empty where it failed.
        failure: why there is nothing, or None.
        seconds, processor_seconds: wall time, and that of all threads.
        pictures_file: where its pictures are, or None.
    """

    label: str
    values: Mapping[str, Any]
    failure: str | None
    seconds: float
    processor_seconds: float
    pictures_file: Path | None = None

    def pictures(self) -> dict[str, NDArray[np.uint8]]:
        """(h, w, 3) by name."""
        if self.pictures_file is None:
            return {}
        with np.load(self.pictures_file) as stored:
            return {name: stored[name] for name in stored.files}


def kept(unit: Unit, folder: Path) -> Record | None:
    """What a unit found before, or None.

    Args:
        unit: the question.
        folder: of all results.

    Raises:
        ExperimentError: its file can't be read.
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
    """Answer a question and keep the answer; an answer is there as a whole or not at all.

    An error of the kind that a user can cause, such as an overexposed contact, is an answer too:
    a gap with its reason.

    Raises:
        SetupError: the renderer can't run on this machine.
        OutputError: nothing can be written.
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
