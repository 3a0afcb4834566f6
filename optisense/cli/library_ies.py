"""Addition of a light from an IES file; data that the file lacks are asked for."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from optisense.cli.console import messages

if TYPE_CHECKING:
    from optisense.design import Status
    from optisense.library import Added


def add_ies_file(
    file: Path,
    *,
    name: str | None,
    colour: str | None,
    flux: float | None,
    wavelength: float | None,
    current: float | None,
    window: str | None,
    package: str | None,
    description: str | None,
    source: str | None,
    status: str,
) -> Added:
    """Store a light from an IES file; its colour and flux are asked for at a terminal.

    Raises:
        LibraryError: the file is damaged, or the name is taken.
        OutputError: the user's folder can't be written.
        typer.BadParameter: an option can't be read, or is missing while there is no terminal.
    """
    from datetime import date

    from optisense import library
    from optisense.library.adding import check_new_name
    from optisense.library.own_parts import own_folder

    check_new_name(file.stem if name is None else name)
    profile = library.ies.read_ies(file)
    opening, body = _lengths(window, 2, "--window"), _lengths(package, 3, "--package")
    trust = _status(status)
    if colour is None or flux is None:
        if not sys.stdin.isatty():
            missing = "--colour" if colour is None else "--flux"
            raise typer.BadParameter(
                "the IES file does not tell it; give it here", param_hint=missing
            )
        messages.print(f"{file.name} gives {profile.lumens:.4g} lm into {own_folder()}")
    if colour is None:
        colour = typer.prompt("Colour (red, green, blue, white or R,G,B)", err=True)
    colour_name, rgb = library.parse_colour(str(colour))
    if flux is None:
        flux = typer.prompt("Radiant flux in mW", type=float, err=True)
    for option, value in (("--flux", flux), ("--wavelength", wavelength), ("--current", current)):
        if value is not None and not 0.0 < value < float("inf"):
            raise typer.BadParameter(f"{value:g} is not above 0", param_hint=option)
    return library.add_ies(
        file,
        flux=float(flux or 0.0),
        colour=rgb,
        colour_name=colour_name,
        name=name,
        description=description,
        wavelength=wavelength,
        current=current,
        window=(opening[0], opening[1]) if opening else None,
        package=(body[0], body[1], body[2]) if body else None,
        source=source or "given when the light was added",
        status=trust,
        date=date.today().isoformat(),
    )


def _lengths(text: str | None, count: int, option: str) -> tuple[float, ...] | None:
    """Parse lengths in mm such as 2.8x3.5x1.9."""
    if text is None:
        return None
    try:
        lengths = tuple(float(word) for word in text.lower().replace("×", "x").split("x"))
    except ValueError:
        lengths = ()
    if len(lengths) != count or not all(0.0 < length < 1000.0 for length in lengths):
        example = "x".join(["2.8", "3.5", "1.9"][:count])
        raise typer.BadParameter(
            f"'{text}' is not {count} lengths in mm, such as {example}", param_hint=option
        )
    return lengths


def _status(text: str) -> Status:
    from optisense.design import Status

    try:
        return Status(text)
    except ValueError:
        known = ", ".join(status.value for status in Status)
        raise typer.BadParameter(f"'{text}' is none of {known}", param_hint="--status") from None
