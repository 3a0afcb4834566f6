"""Reader of entries of the library; errors name file and line."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

from pydantic import TypeAdapter, ValidationError

from optisense.design.emitters import LightModel
from optisense.design.fields import Model
from optisense.design.kinds import KindModel
from optisense.design.materials import CoatingModel, Material
from optisense.design.problems import design_error
from optisense.design.yaml_reader import Lines, read_yaml
from optisense.errors import LibraryError
from optisense.library._entries import (
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
    """Read a file that holds one entry, and the files that it may name.

    Raises:
        LibraryError: a file can't be read, or is no entry of this kind; the message names the line.
    """
    data, lines = read_yaml(file, LibraryError)
    entry = make_entry(kind, file.stem, data, lines, str(file))
    value: Model = entry.value
    if isinstance(value, KindModel):
        value.located(file.parent).verify()
    return entry


def files_of(value: Model) -> dict[str, bytes]:
    """Return the contents of the files that a value of an entry names, by their names.

    Raises:
        LibraryError: a file can't be read.
    """
    return value.contents() if isinstance(value, KindModel) else {}


def make_entry(kind: Kind, name: str, data: Any, lines: Lines, source: str) -> AnyEntry:
    """Check the data of an entry, and return the entry.

    Args:
        lines: line of each value in the data; the first line of all is under ().
        source: file, for messages.

    Raises:
        LibraryError: the data are no entry of this kind; the message names the line.
    """
    adapter: TypeAdapter[AnyEntry] = TypeAdapter(KINDS[kind])
    try:
        return adapter.validate_python(data)
    except ValidationError as error:
        found = design_error(error, data, where=source, lines=lines, model=KINDS[kind])
        message = f"{kind} '{name}': {found.message}"
        raise LibraryError(message, where=found.where, hint=found.hint) from None


def kind_of(data: dict[str, Any]) -> Kind | None:
    """Return the kind of entry that a file's data describe, or None if it is unknown."""
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
