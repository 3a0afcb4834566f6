"""The reader of the library's entries in files, whose errors name file and line, and the folder of
the user's own entries.

The user's own parts are in a folder with a file for each entry, and are read together with the
built-in ones. `materials/NAME.yaml`, `coatings/`, `lights/` (with their .ies files) and `cameras/`
are in the folder that the environment variable OPTISENSE_LIBRARY names, or else in
`optisense/library` of the user's configuration folder ($XDG_CONFIG_HOME, or ~/.config).
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal

from pydantic import TypeAdapter, ValidationError

from optisense.design.emitters import LightModel
from optisense.design.fields import Model
from optisense.design.kinds import KindModel
from optisense.design.materials import CoatingModel, Material
from optisense.design.problems import design_error
from optisense.design.yaml_reader import Lines, read_yaml
from optisense.design.yaml_writer import to_yaml
from optisense.errors import LibraryError
from optisense.library._entries import (
    AnyEntry,
    CameraEntry,
    CoatingEntry,
    LightEntry,
    MaterialEntry,
)
from optisense.writing import written_together

Kind = Literal["material", "coating", "light", "camera"]

KINDS: dict[Kind, Any] = {
    "material": MaterialEntry,
    "coating": CoatingEntry,
    "light": LightEntry,
    "camera": CameraEntry,
}

HEADS: dict[Kind, str] = {
    "material": "Optical material. Indices at 630, 528 and 465 nm for R, G, B.",
    "coating": "Coating. eta and k are those of the metal flake at 630, 528, 465 nm.",
    "light": "Light. Lengths in mm, angles in degrees, flux in mW, current in mA.",
    "camera": "Camera. fov in degrees across the width, pixel_size in micrometres, focal_length "
    "in mm.",
}


WHERE_TO_STORE = "Name a folder that you may write to in the environment variable OPTISENSE_LIBRARY"


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

    Raises:
        LibraryError: the data are no entry of this kind; the message names the file `source`, and
            the line of the value.
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


def own_folder() -> Path:
    """Return the folder of the user's own parts, which need not exist."""
    named = os.environ.get("OPTISENSE_LIBRARY")
    if named:
        return Path(named).expanduser()
    config = os.environ.get("XDG_CONFIG_HOME")
    base = Path(config) if config else Path.home() / ".config"
    return base / "optisense" / "library"


def own_names(kind: Kind) -> set[str]:
    """Return the names of the user's own entries of a kind."""
    files = (own_folder() / f"{kind}s").glob("*.yaml")
    return {file.stem for file in files if not file.name.startswith(".")}


def own_file(kind: Kind, name: str) -> Path | None:
    """Return the file of the user's own entry of this name, without listing the folder; None if
    there is no such entry.
    """
    file = own_folder() / f"{kind}s" / f"{name}.yaml"
    if name != file.stem or name.startswith("."):  # a path, or a hidden file
        return None
    return file if os.path.lexists(file) else None


def write_own(
    kind: Kind, name: str, entry: AnyEntry, files: Mapping[str, bytes] = MappingProxyType({})
) -> Path:
    """Write an entry, and before it the files that it names, into the user's folder, whose lock is
    held, whole or not at all; return the path of the entry's file.

    Raises:
        OutputError: the folder can't be written.
    """
    file = own_folder() / f"{kind}s" / f"{name}.yaml"
    with written_together("your library", WHERE_TO_STORE) as stage:
        for own, data in files.items():
            stage(file.parent / own).write_bytes(data)
        stage(file).write_text(to_yaml(entry, HEADS[kind]), encoding="utf-8")
    return file
