"""Reading entries of the library; what is wrong is told with file and line."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

from pydantic import TypeAdapter, ValidationError

from optisense.design.emitters import LightModel
from optisense.design.fields import Model
from optisense.design.kinds import KindModel
from optisense.design.materials import CoatingModel, Material
from optisense.design.problems import design_error
from optisense.design.yaml_reader import Lines, Steps, read_yaml
from optisense.errors import LibraryError
from optisense.library.entries import (
    AnyEntry,
    CameraEntry,
    CoatingEntry,
    LightEntry,
    MaterialEntry,
)

Kind = Literal["material", "coating", "light", "camera"]

KINDS: dict[Kind, Any] = {
    "material": MaterialEntry,
    "coating": CoatingEntry,
    "light": LightEntry,
    "camera": CameraEntry,
}


def read_entry(kind: Kind, file: Path) -> AnyEntry:
    """Read a file that holds one entry, and the files it may name.

    Raises:
        LibraryError: a file can't be read, or is no entry of this kind; says the line.
    """
    data, lines = read_yaml(file, LibraryError)
    entry = make_entry(kind, file.stem, data, lines, str(file))
    value: Model = entry.value
    if isinstance(value, KindModel):
        value.located(file.parent).check()
    return entry


def files_of(value: Model) -> dict[str, bytes]:
    """Contents of the files that a value of an entry names, by their names.

    Raises:
        LibraryError: one can't be read.
    """
    return value.contents() if isinstance(value, KindModel) else {}


def make_entry(kind: Kind, name: str, data: Any, lines: Lines, source: str) -> AnyEntry:
    """Check the data of an entry.

    Args:
        data: what YAML gave for it.
        lines: the line of each value in it; the first line of all is under ().
        source: the file, for messages.

    Raises:
        LibraryError: it is no entry of this kind; says the line.
    """
    adapter: TypeAdapter[AnyEntry] = TypeAdapter(KINDS[kind])
    try:
        return adapter.validate_python(data)
    except ValidationError as error:
        found = design_error(error, data, where=source, lines=lines, model=KINDS[kind])
        message = f"{kind} '{name}': {found.message}"
        raise LibraryError(message, where=found.where, hint=found.hint) from None


def inside(lines: Lines, key: str) -> Lines:
    """The lines of what is under a key, by their paths from there."""
    rest: dict[Steps, int] = {}
    for path, line in lines.items():
        if path[:1] == (key,):
            rest[path[1:]] = line
    return rest


def kind_of(data: dict[str, Any]) -> Kind | None:
    """The kind of entry that a file's data describe, or None if it is unknown."""
    value = data.get("value")
    if not isinstance(value, dict):
        return None
    if value.get("kind") in LightModel.kinds:
        return "light"
    if value.get("kind") in Material.kinds:
        return "material"
    if value.get("kind") in CoatingModel.kinds or "specularity" in value:
        return "coating"
    return "camera" if "fov" in value or "projection" in value else None
