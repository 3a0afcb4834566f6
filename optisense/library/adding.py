"""Check of a user's own part, and its storage in the user's library folder."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from optisense.design.colour import NAMED_COLOURS
from optisense.design.emitters import IesEmitter
from optisense.design.fields import Colour, Model
from optisense.design.ies import parse_ies
from optisense.design.kinds import KindModel
from optisense.design.sensor_design import Status
from optisense.design.yaml_reader import read_yaml
from optisense.errors import LibraryError
from optisense.folders import held
from optisense.library._entries import (
    AnyEntry,
    LensFacts,
    LightEntry,
    Source,
    TypicalLight,
)
from optisense.library.loader import entry, is_own, kind_named, names
from optisense.library.storage import (
    KINDS,
    WHERE_TO_STORE,
    Kind,
    files_of,
    kind_of,
    make_entry,
    own_folder,
    read_entry,
    write_own,
)
from optisense.library.tuning import DAYLIGHT, read_tuning
from optisense.near import suggestion
from optisense.untrusted_files import MOST_DATA, read_bytes

NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,63}")

OF_THE_LENS = (*LensFacts.model_fields, "distortion", "blur")
"""Fields of a camera that depend on its lens and the pixels of its picture alone."""


@dataclass(frozen=True)
class Added:
    """Part that was stored.

    Attributes:
        kind: kind of the part.
        name: name for designs.
        entry: entry of the part.
        file: its file in the user's folder.
        taken: fields that were taken from another entry.
    """

    kind: Kind
    name: str
    entry: AnyEntry
    file: Path
    taken: tuple[str, ...] = ()


def add_file(file: str | Path, kind: str | None = None, name: str | None = None) -> Added:
    """Add an entry from a YAML file, with the files that it may name.

    Args:
        kind: material, coating, light or camera; None infers it from the file.
        name: name for designs; None takes the name of the file.

    Raises:
        LibraryError: the file can't be read or is no entry (the message names the line), its kind
            is unclear, or the name is taken.
        OutputError: the user's folder can't be written.
    """
    file = Path(file)
    name = file.stem if name is None else name
    check_new_name(name)
    data, lines = read_yaml(file, LibraryError)
    if kind is None:
        detected = kind_of(data)
        if detected is None:
            raise LibraryError(
                "the kind of part in the file is unclear",
                where=f"{file}:{lines.get(('value',), 1)}",
                hint="Name it: --kind material, coating, light or camera; a file holds one entry "
                "with 'description', 'value' and 'sources'",
            )
        kind = detected
    singular = kind_named(kind)
    entry = read_entry(singular, file)
    files = _taken_along(entry.value, name)
    return Added(singular, name, entry, _stored(singular, name, entry, files))


def _taken_along(value: Model, name: str) -> dict[str, bytes]:
    """Return the contents of the files of a value, and rename these after its entry."""
    found = files_of(value)
    own = {file: f"{name}{Path(file).suffix}" for file in found}
    if len(set(own.values())) < len(own):  # several with one suffix keep their own names too
        own = {file: f"{name}-{Path(file).name}" for file in found}
    if isinstance(value, KindModel):
        value.renamed(own.__getitem__, value.folder)
    return {own[file]: data for file, data in found.items()}


def add_ies(
    file: str | Path,
    light: TypicalLight,
    source: Source | None = None,
    *,
    colour_name: str = "own",
    name: str | None = None,
    description: str | None = None,
    window: tuple[float, float] | None = None,
    package: tuple[float, float, float] | None = None,
) -> Added:
    """Add a light from its IES file and the data that this file lacks.

    Args:
        light: colour, radiant flux (mW), dominant wavelength (nm) and current (mA).
        source: source of these numbers and sizes; assumed if None.
        colour_name: name of the colour in the entry.
        name: name of the light for designs; None takes the name of the file.
        description: description in one line.
        window: width and height of its opening, mm; it is simulated as a point all the same.
        package: width, length and height of its body, mm.

    Raises:
        LibraryError: the file can't be read or is damaged (the message names the line), there is
            no flux, or the name is taken.
        OutputError: the user's folder can't be written.
    """
    file = Path(file)
    name = file.stem if name is None else name
    check_new_name(name)
    data = read_bytes(file, MOST_DATA, LibraryError, "the IES file")
    parse_ies(data.decode("latin-1"), str(file))
    if source is None:
        source = Source(status=Status.ASSUMED, source="given when the light was added")
    given = {"window": window, "package": package}
    given |= {name: getattr(light, name) for name in ("wavelength", "current", "flux")}
    about = Source(status=Status.SOURCED, source=_about(data) or file.name, date=source.date)
    sources = {field: source for field, value in given.items() if value is not None}
    if not light.flux:
        raise LibraryError("the light has no flux", hint="Give its radiant flux in mW")
    entry = LightEntry(
        description=description or f"Light with the IES file {file.name}",
        value=IesEmitter(file=f"{name}.ies"),
        package=package,
        window=window,
        typical={colour_name: light},
        sources={"file": about, **sources},
    )
    return Added("light", name, entry, _stored("light", name, entry, {f"{name}.ies": data}))


def add_tuning(
    file: str | Path,
    *,
    like: str,
    name: str | None = None,
    description: str | None = None,
    temperature: float = DAYLIGHT,
) -> Added:
    """Add a camera with the data of its lens, sensor and processor in a tuning file of libcamera.

    Args:
        file: JSON file.
        like: camera of the library whose lens and pixels it has: projection, field of view,
            resolution, pixel size, focal length, f-number, distortion and blur.
        name: name for designs; None takes the name of the file.
        description: description in one line.
        temperature: colour temperature of the light for which its colours are taken, K.

    Raises:
        LibraryError: the file can't be read or is no tuning file, there is no such camera, or the
            name is taken.
        OutputError: the user's folder can't be written.
    """
    file = Path(file)
    name = file.stem if name is None else name
    check_new_name(name)
    known, tuning = entry("camera", like), read_tuning(file, temperature)
    own = known.value.model_dump(mode="json", exclude_none=True, include=set(OF_THE_LENS))
    given = Source(status=Status.SOURCED, source=f"tuning file {file.name} at {temperature:g} K")
    sources = {field: source for field, source in known.sources.items() if field in own}
    sources |= dict.fromkeys(tuning.values, given)
    for field, why in tuning.derived.items():
        sources[field] = Source(status=Status.DERIVED, source=why)
    made = make_entry(
        "camera",
        name,
        {
            "description": description or f"{known.description}, tuned by {file.name}",
            "value": own | tuning.values,
            "sources": {field: source.model_dump(mode="json") for field, source in sources.items()},
        },
        {(): 1},
        str(file),
    )
    return Added("camera", name, made, _stored("camera", name, made, {}), tuple(own))


def check_new_name(name: str) -> None:
    """Raise LibraryError if a part can't be given this name, as it has other characters than
    letters, digits, '-' and '_', or is taken.
    """
    if NAME.fullmatch(name) is None:
        raise LibraryError(
            f"'{name}' can't be the name of a part",
            hint="Give one of letters, digits, '-' and '_' with --name",
        )
    for kind in KINDS:
        if name in names(kind):
            whose = "one of your own parts" if is_own(kind, name) else "built in"
            raise LibraryError(
                f"the library already has a {kind} '{name}' ({whose})",
                hint="Choose another name with --name"
                + (", or delete the old file" if is_own(kind, name) else ""),
            )


def _stored(kind: Kind, name: str, entry: AnyEntry, files: Mapping[str, bytes]) -> Path:
    """Write an entry unless another process has taken its name meanwhile, and return its file."""
    with held(own_folder(), wait=True, hint=WHERE_TO_STORE):
        check_new_name(name)
        return write_own(kind, name, entry, files)


def parse_colour(text: str) -> tuple[str, Colour]:
    """Return name and R, G, B of a colour given as 'red', 'green', 'blue', 'white' or '1,0.5,0'.

    Raises:
        LibraryError: the text is neither.
    """
    if text in NAMED_COLOURS:
        return text, NAMED_COLOURS[text]
    try:
        red, green, blue = (float(word) for word in text.split(","))
    except ValueError:
        raise LibraryError(
            f"'{text}' is no colour",
            hint=suggestion(text, NAMED_COLOURS)
            or "Give red, green, blue, white or R,G,B from 0 to 1",
        ) from None
    if not all(0.0 <= value <= 1.0 for value in (red, green, blue)) or red + green + blue <= 0.0:
        raise LibraryError(
            f"'{text}' is no colour", hint="Each value is from 0 to 1, and not all are 0"
        )
    return "own", (red, green, blue)


def _about(ies: bytes) -> str:
    """Return what the header of an IES file says about its origin."""
    header = ies.decode("latin-1").split("TILT=")[0]
    words = [
        match[1].strip()
        for key in ("MANUFAC", "LUMCAT", "LUMINAIRE", "TEST", "TESTLAB")
        if (match := re.search(rf"^\[{key}\](.*)$", header, re.MULTILINE))
    ]
    return ", ".join(word for word in words if word)[:500]
