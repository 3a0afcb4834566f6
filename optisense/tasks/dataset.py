"""A dataset of labelled contacts on disk, and how to read it."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from optisense.errors import TaskError
from optisense.tasks.records import read_json, read_rows

SCHEMA_VERSION = 1
"""Version of the format of a dataset's folder; it is raised when an older program cannot read
it."""

INFO = "dataset.json"
LABELS = "metadata.csv"
FAILURES = "failures.csv"
BACKGROUND = "background.npz"
DESIGN = "design"

TEXT_COLUMNS = ("file_name", "arrays", "radiance", "indenter")
WHOLE_COLUMNS = ("index", "contact_pixels", "attempt")
NUMBER_COLUMNS = {
    "radius": "mm, of a ball or a cylinder; empty for others",
    "x": "mm, the place on the untouched surface, in the design's frame",
    "y": "mm",
    "z": "mm",
    "column": "pixels from the picture's left edge, where the place is seen",
    "row": "pixels from its top edge",
    "depth": "mm, from the untouched surface to the indenter's lowest point",
    "rotation": "degrees about the outward normal",
    "tilt_x": "degrees about the indenter's x axis",
    "tilt_y": "degrees about its y axis, after tilt_x",
    "deepest": "mm, the largest depth that the picture shows",
}
COLUMNS = (
    "file_name",
    "index",
    "indenter",
    *NUMBER_COLUMNS,
    "contact_pixels",
    "attempt",
    "arrays",
    "radiance",
)
"""Columns of `LABELS`; the first is what common loaders of picture folders look for."""


@dataclass(frozen=True)
class Sample:
    """One labelled contact; arrays are (h, w, ...), row 0 is the top.

    image: uint8 sRGB. depth: float32 mm, pushed in along the inward normal. normals: float32
    unit, inward, in the design's frame. mask: bool, where the indenter is seen. labels: a row of
    `LABELS`, numbers as numbers.
    """

    image: NDArray[np.uint8]
    depth: NDArray[np.float32]
    normals: NDArray[np.float32]
    mask: NDArray[np.bool_]
    labels: dict[str, Any]


@dataclass(frozen=True)
class Dataset:
    """A folder of samples, opened for reading; samples are read when they are asked for.

    info: what `dataset.json` says. labels: one row a sample, in the order of the samples.
    failures: rows of contacts that could not be made.
    """

    folder: Path
    info: dict[str, Any]
    labels: list[dict[str, Any]]
    failures: list[dict[str, str]]

    @classmethod
    def load(cls, folder: str | Path) -> Dataset:
        """Open a dataset, finished or not.

        Raises:
            TaskError: the folder holds no dataset, or one of another release.
        """
        folder = Path(folder)
        if not (folder / INFO).is_file():
            raise TaskError(
                "there is no dataset here",
                where=str(folder),
                hint=f"Name a folder that holds a {INFO}",
            )
        info = read_json(folder / INFO)
        if info.get("schema_version") != SCHEMA_VERSION:
            raise TaskError(
                f"schema_version {info.get('schema_version')!r} can't be read; this release "
                f"reads {SCHEMA_VERSION}",
                where=str(folder / INFO),
            )
        labels = [_typed(row, folder / LABELS) for row in read_rows(folder / LABELS)]
        failures = folder / FAILURES
        return cls(folder, info, labels, read_rows(failures) if failures.exists() else [])

    def __len__(self) -> int:
        return len(self.labels)

    def __getitem__(self, number: int) -> Sample:
        labels = self.labels[number]
        arrays = self._arrays(labels["arrays"])
        return Sample(
            image=read_picture(self._existing(labels["file_name"])),
            depth=arrays["depth"],
            normals=arrays["normals"],
            mask=arrays["mask"],
            labels=labels,
        )

    def __iter__(self) -> Iterator[Sample]:
        return (self[number] for number in range(len(self)))

    def background(self) -> dict[str, NDArray[Any]]:
        """The untouched sensor: image (uint8, without camera noise), points (mm), normals."""
        return self._arrays(BACKGROUND)

    def _existing(self, name: str) -> Path:
        path = Path(os.path.realpath(self.folder / name.split("\0")[0]))
        if "\0" in name or not path.is_relative_to(os.path.realpath(self.folder)):
            raise TaskError(
                f"'{name}' leads out of the dataset's folder",
                where=str(self.folder / LABELS),
                hint="A stranger may have made it so: copy files that you trust into the folder",
            )
        if not path.is_file():
            raise TaskError(
                f"the dataset lacks the file '{name}'",
                where=str(self.folder),
                hint="Copy the folder again, or make the dataset anew",
            )
        return path

    def _arrays(self, name: str) -> dict[str, NDArray[Any]]:
        path = self._existing(name)
        try:
            with np.load(path, allow_pickle=False) as file:
                return dict(file)
        except (OSError, ValueError, EOFError) as error:
            raise TaskError(f"can't read the arrays: {error}", where=str(path)) from error


def read_picture(path: Path) -> NDArray[np.uint8]:
    """(h, w, 3) uint8 of a picture file.

    Raises:
        TaskError: it can't be read.
    """
    try:
        with Image.open(path) as picture:
            return np.asarray(picture.convert("RGB"), dtype=np.uint8)
    except OSError as error:  # also for files that are no picture
        raise TaskError(f"can't read the picture: {error}", where=str(path)) from error


def write_picture(path: Path, picture: NDArray[np.uint8]) -> None:
    """Write (h, w, 3) uint8 as a PNG file."""
    Image.fromarray(picture).save(path, format="PNG")


def _typed(row: dict[str, str], path: Path) -> dict[str, Any]:
    try:
        result: dict[str, Any] = {name: row[name] for name in TEXT_COLUMNS}
        result |= {name: int(row[name]) for name in WHOLE_COLUMNS}
        result |= {n: float(row[n]) if row[n] else float("nan") for n in NUMBER_COLUMNS}
    except (KeyError, TypeError, ValueError) as error:
        raise TaskError(f"a row can't be read: {error}", where=str(path)) from error
    return {name: result[name] for name in COLUMNS}
