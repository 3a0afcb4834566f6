"""Access to the entries of the library: the built-in ones, and the user's own."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import Any

from optisense.design.check import unknown_light_hint
from optisense.design.emitters import LightModel
from optisense.design.lights import LightGroup
from optisense.design.materials import CoatingModel, Material
from optisense.design.yaml_reader import read_yaml
from optisense.errors import LibraryError
from optisense.library._entries import AnyEntry, CameraModel
from optisense.library.storage import KINDS, Kind, make_entry, own_file, own_names, read_entry
from optisense.near import suggestion

FOLDER = Path(__file__).parent


def names(kind: str) -> list[str]:
    """Return the names of all entries of a kind: material, coating, light or camera (or its
    plural).

    The user's own are included; only the names of their files are read.

    Raises:
        LibraryError: there is no such kind.
    """
    singular = kind_named(kind)
    return sorted({*_built_in(singular), *own_names(singular)})


def is_own(kind: str, name: str) -> bool:
    """Return whether an entry is one of the user's own parts.

    Raises:
        LibraryError: there is no such kind.
    """
    return own_file(kind_named(kind), name) is not None


def entry(kind: str, name: str) -> AnyEntry:
    """Return an entry with its description and the sources of its numbers.

    Raises:
        LibraryError: there is no such kind or entry (a similar name is suggested), the user's own
            file of it can't be read, or it has the name of a built-in one.
    """
    singular = kind_named(kind)
    entries, own = _built_in(singular), own_file(singular, name)
    if own is not None:
        if name in entries:
            raise LibraryError(
                f"{singular} '{name}' is built in, and also one of your own parts",
                where=str(own),
                hint="Give your file another name",
            )
        return read_entry(singular, own)
    if name not in entries:
        hint = suggestion(name, names(singular), limit=25)
        raise LibraryError(f"the library has no {singular} '{name}'", hint=hint)
    return entries[name].model_copy(deep=True)


def material(name: str) -> Material:
    """Return the optical material of this name.

    Raises:
        LibraryError: there is none; the message suggests a similar name.
    """
    value: Any = entry("material", name).value
    return value


def coating(name: str) -> CoatingModel:
    """Return the coating of this name, which is also in its `library` field.

    Raises:
        LibraryError: there is none; the message suggests a similar name.
    """
    value: Any = entry("coating", name).value
    value.library = name
    return value


def light(name: str) -> LightModel:
    """Return the emission of the light of this name.

    Raises:
        LibraryError: there is none; the message suggests a similar name.
    """
    value: Any = entry("light", name).value
    return value


def camera(name: str) -> CameraModel:
    """Return the camera of this name.

    Raises:
        LibraryError: there is none; the message suggests a similar name.
    """
    value: Any = entry("camera", name).value
    return value


def emitter(group: LightGroup) -> LightModel:
    """Return the emission of the lights of a design's group: its own emitter, or the library's
    light.

    Raises:
        LibraryError: the group has neither.
    """
    if group.emitter is not None:
        return group.emitter
    known = names("light")
    if group.model not in known:
        raise LibraryError(
            f"a light group names the light '{group.model}', which this library lacks",
            hint=unknown_light_hint(group.model, known),
        )
    return light(group.model)


def kind_named(text: str) -> Kind:
    """Return the kind that a word names, singular or plural.

    Raises:
        LibraryError: there is no such kind; the message suggests a similar name.
    """
    for kind in KINDS:
        if text in (kind, f"{kind}s"):
            return kind
    raise LibraryError(f"the library has no kind '{text}'", hint=suggestion(text, KINDS))


@lru_cache(maxsize=len(KINDS))
def _built_in(kind: Kind) -> dict[str, AnyEntry]:
    """Return all built-in entries of a kind by name; lights and cameras have a file each, materials
    and coatings share one.
    """
    if kind in ("light", "camera"):
        files = sorted((FOLDER / f"{kind}s").glob("*.yaml"))
        return {file.stem: read_entry(kind, file) for file in files}
    file = FOLDER / f"{kind}s.yaml"
    data, lines = read_yaml(file, LibraryError)
    entries = {}
    for name, value in data.items():
        own = {path[1:]: line for path, line in lines.items() if path[:1] == (name,)}
        entries[name] = make_entry(kind, name, value, own, str(file))
    return entries
