"""Tables of a dataset, and the file that describes it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from optisense.errors import TaskError
from optisense.tasks._records import read_object
from optisense.tasks._splits import SPLITS
from optisense.text import brief
from optisense.untrusted_files import COPY_AGAIN, first_problem, read_table

SCHEMA_VERSION = 1
"""Version of the format of a dataset's folder; it is raised when older programs cannot read it."""

INFO = "dataset.json"
LABELS = "metadata.csv"
FAILURES = "failures.csv"

TEXT_COLUMNS = ("file_name", "arrays", "radiance", "indenter", "split")
WHOLE_COLUMNS = ("index", "contact_pixels", "cut", "attempt")
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
    "force": "N, along the outward normal; empty for a conforming skin",
    "area": "mm^2 of skin that touches; empty for a conforming skin",
    "pressure": "MPa, the greatest; empty for a conforming skin",
}
LATER_COLUMNS = {"force": "", "area": "", "pressure": "", "cut": "-1", "split": ""}
"""Columns that tables of release 0.1 lack, with their default values; such tables can be read."""
COLUMNS = (
    "file_name",
    "index",
    "indenter",
    *NUMBER_COLUMNS,
    "contact_pixels",
    "attempt",
    "arrays",
    "radiance",
    "cut",
    "split",
)
"""Columns of `LABELS`; the first is the one that common loaders of image folders expect."""

FiniteNumber = Annotated[float, Field(allow_inf_nan=False)]


class _KeptContacts(BaseModel):
    """The stored ranges of contacts: any values, which are compared with the requested ones."""

    model_config = ConfigDict(extra="allow")

    indenters: list[str] = Field(min_length=1)


class _KeptSettings(BaseModel):
    """The stored settings of a dataset: any further values, compared with the requested ones."""

    model_config = ConfigDict(extra="allow")

    contacts: _KeptContacts
    resolution: tuple[Annotated[int, Field(ge=1)], Annotated[int, Field(ge=1)]]
    estimator: str


class _Info(BaseModel):
    """The required content of `INFO`; further content is for people."""

    model_config = ConfigDict(extra="allow", strict=False)

    schema_version: Literal[1]
    design_name: str
    made_with: dict[str, str]
    settings: _KeptSettings
    mesh_files: dict[str, str] = Field(default_factory=dict)
    meshes: dict[str, str]
    exposure: Annotated[FiniteNumber, Field(gt=0.0)]


def read_info(folder: Path) -> dict[str, Any]:
    """Return the content of `dataset.json`; TaskError says if it is missing, damaged, or of another
    release.
    """
    path = folder / INFO
    info = read_object(path)
    if info.get("schema_version") != SCHEMA_VERSION:
        raise TaskError(
            f"schema_version {brief(repr(info.get('schema_version')))} can't be read; this release "
            f"reads {SCHEMA_VERSION}",
            where=str(path),
            hint="Update OptiSense Studio, or copy the file again",
        )
    try:
        _Info.model_validate(info)
    except ValidationError as error:
        raise TaskError(first_problem(error), where=str(path), hint=COPY_AGAIN) from None
    return info


def read_labels(folder: Path) -> list[dict[str, Any]]:
    """Return the rows of `LABELS` with converted numbers; empty if there is no such file yet.
    TaskError names the line that cannot be read.
    """
    labels: dict[int, dict[str, Any]] = {}
    for where, given in _rows(folder / LABELS):
        row = _typed(given, where)
        index = row["index"]
        if index in labels or index < 0:
            raise TaskError(
                f"sample {index} is listed twice"
                if index >= 0
                else f"the index {index} is negative",
                where=where,
                hint="Delete the line",
            )
        labels[index] = row
    return list(labels.values())


def read_failures(folder: Path) -> list[dict[str, str]]:
    """Return the rows of `FAILURES`; empty if there is no such file yet. TaskError names the line
    that cannot be read.
    """
    rows = _rows(folder / FAILURES)
    for where, row in rows:
        if not (row.get("index") or "").isdecimal() or row.get("reason") is None:
            raise TaskError("a row can't be read", where=where, hint=ROW_AGAIN)
    return [row for _, row in rows]


def _rows(path: Path) -> list[tuple[str, dict[str, str]]]:
    """Return the rows of a table, each with the place of its line; none if there is no table."""
    rows = read_table(path, TaskError) if path.exists() else []
    return [(f"{path}:{line}", row) for line, row in enumerate(rows, start=2)]


ROW_AGAIN = "Delete the line; the command that made the dataset then makes the sample again"


def _typed(row: dict[str, str], where: str) -> dict[str, Any]:
    try:
        given = {**LATER_COLUMNS, **row}
        result: dict[str, Any] = {name: given[name] for name in TEXT_COLUMNS}
        result |= {name: int(given[name]) for name in WHOLE_COLUMNS}
        if given["split"] not in ("", *SPLITS):
            raise ValueError(f"there is no split '{brief(given['split'])}'")
        result |= {n: float(given[n]) if given[n] else float("nan") for n in NUMBER_COLUMNS}
    except (KeyError, TypeError, ValueError) as error:
        raise TaskError(f"a row can't be read: {error}", where=where, hint=ROW_AGAIN) from error
    return {name: result[name] for name in COLUMNS}
