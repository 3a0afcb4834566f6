"""Finding and reading the entries of the library."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter, ValidationError

from optisense.design.emitters import IesEmitter, LightModel
from optisense.design.lights import LightGroup
from optisense.design.materials import Coating, Material
from optisense.design.near import suggestion
from optisense.design.yaml_reader import read_yaml
from optisense.errors import LibraryError
from optisense.library.entries import (
    CameraEntry,
    CameraModel,
    CoatingEntry,
    Entry,
    LightEntry,
    MaterialEntry,
)

FOLDER = Path(__file__).parent
KINDS: dict[str, Any] = {
    "material": MaterialEntry,
    "coating": CoatingEntry,
    "light": LightEntry,
    "camera": CameraEntry,
}


def names(kind: str) -> list[str]:
    """The names of all entries of a kind: material, coating, light or camera (or its plural).

    Raises:
        LibraryError: there is no such kind.
    """
    return sorted(_entries(_kind(kind)))


def entry(kind: str, name: str) -> Entry[Any]:
    """An entry with its description and the sources of its numbers.

    Raises:
        LibraryError: there is no such kind or entry; names the near match.
    """
    kind = _kind(kind)
    entries = _entries(kind)
    if name not in entries:
        raise LibraryError(
            f"the library has no {kind} '{name}'", hint=suggestion(name, entries, limit=20)
        )
    return entries[name].model_copy(deep=True)


def material(name: str) -> Material:
    """The optical material of this name.

    Raises:
        LibraryError: there is none; names the near match.
    """
    value: Material = entry("material", name).value
    return value


def coating(name: str) -> Coating:
    """The coating of this name; its `library` field says so.

    Raises:
        LibraryError: there is none; names the near match.
    """
    value: Coating = entry("coating", name).value
    value.library = name
    return value


def light(name: str) -> LightModel:
    """How the light of this name emits.

    Raises:
        LibraryError: there is none; names the near match.
    """
    value: LightModel = entry("light", name).value
    return value


def camera(name: str) -> CameraModel:
    """The camera of this name.

    Raises:
        LibraryError: there is none; names the near match.
    """
    value: CameraModel = entry("camera", name).value
    return value


def emitter(group: LightGroup) -> LightModel:
    """How the lights of a design's group emit: its own emitter, or the library's light.

    Raises:
        LibraryError: the group has neither.
    """
    return group.emitter if group.emitter is not None else light(group.model)


def _kind(kind: str) -> str:
    singular = "camera" if kind == "cameras" else kind.removesuffix("s")
    if singular not in KINDS:
        raise LibraryError(f"the library has no kind '{kind}'", hint=suggestion(kind, KINDS))
    return singular


@cache
def _entries(kind: str) -> dict[str, Entry[Any]]:
    """All entries of a kind by name; lights have a file each, other kinds share one."""
    adapter: TypeAdapter[Any] = TypeAdapter(KINDS[kind])
    found: dict[str, Entry[Any]] = {}
    for name, data, where in _raw(kind):
        try:
            found[name] = adapter.validate_python(data)
        except ValidationError as error:
            first = error.errors()[0]
            field = ".".join(str(step) for step in first["loc"])
            raise LibraryError(f"{kind} '{name}', {field}: {first['msg']}", where=where) from None
        value = found[name].value
        if isinstance(value, IesEmitter):
            value._folder = FOLDER / "lights"
    return found


def _raw(kind: str) -> list[tuple[str, Any, str]]:
    """(name, data, file and line) of each entry of a kind."""
    if kind == "light":
        files = sorted((FOLDER / "lights").glob("*.yaml"))
        return [(file.stem, read_yaml(file, LibraryError)[0], str(file)) for file in files]
    file = FOLDER / f"{kind}s.yaml"
    data, lines = read_yaml(file, LibraryError)
    return [(name, value, f"{file}:{lines[(name,)]}") for name, value in data.items()]
