"""Addition of a camera from a tuning file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import typer

if TYPE_CHECKING:
    from optisense.library import Added


def add_tuning_file(
    what: Path,
    tuning: Path,
    *,
    like: str | None,
    temperature: float | None,
    name: str | None,
    description: str | None,
) -> Added:
    """Store a camera from libcamera's tuning file.

    Args:
        what: argument of the command: the word camera.
        tuning: tuning file.
        like: camera of the library whose view it has.
        temperature: colour temperature, K; the default if None.
        name: name for designs; the file's name if None.
        description: description in one line.

    Raises:
        LibraryError: the file is no tuning file, there is no such camera, or the name is taken.
        OutputError: the user's folder can't be written.
        typer.BadParameter: an option is missing or invalid.
    """
    from optisense import library
    from optisense.library.tuning import DAYLIGHT

    if str(what) not in ("camera", "cameras"):
        raise typer.BadParameter(
            f"a tuning file is of a camera: optisense library add camera --tuning {tuning}",
            param_hint="FILE",
        )
    if like is None:
        raise typer.BadParameter(
            "a tuning file does not tell the field of view; name a camera of the library that has "
            "the same, such as --like pi-v2",
            param_hint="--like",
        )
    kelvin = DAYLIGHT if temperature is None else temperature
    if not 1000.0 <= kelvin <= 20_000.0:
        raise typer.BadParameter(f"{kelvin:g} K is no colour of light", param_hint="--temperature")
    return library.add_tuning(
        tuning, like=like, name=name, description=description, temperature=kelvin
    )
