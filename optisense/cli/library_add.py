"""``optisense library add``: addition of an entry of the user's own."""

from __future__ import annotations

import sys
from datetime import date
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from optisense.cli.console import handles_errors, messages, output
from optisense.commands.adding import IesOptions, TuningOptions, above_0
from optisense.text import argument

if TYPE_CHECKING:
    from optisense.library import Added


@handles_errors
def add_entry(
    file: Annotated[
        Path,
        typer.Argument(
            metavar="FILE",
            help="An entry (.yaml, as `library show --yaml` prints), an .ies, or the word camera "
            "with --tuning.",
        ),
    ],
    *,
    kind: Annotated[
        str | None,
        typer.Option(metavar="KIND", help="One of: material, coating, light, camera."),
    ] = None,
    name: Annotated[
        str | None,
        typer.Option(
            metavar="NAME", help="Name of the entry in designs; the file's name if left out."
        ),
    ] = None,
    description: Annotated[
        str | None,
        typer.Option(metavar="TEXT", help="With an .ies or --tuning: what it is, in a line."),
    ] = None,
    ies: IesOptions,
    tuning: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.json",
            help="A tuning file of libcamera, from which noise, shading, colours and tone "
            "curve are read.",
        ),
    ] = None,
    camera: TuningOptions,
) -> None:
    """Check an entry of your own and store it in your library folder.

    The folder is $OPTISENSE_LIBRARY, or else optisense/library in your configuration folder.
    """
    from optisense import library

    if tuning is not None:
        _refuse(ies, "it can't be combined with --tuning")
        added = _from_tuning(file, tuning, camera, name, description)
        fields = ", ".join(field.replace("_", " ") for field in added.taken)
        output.print(f"as {camera.like}: {fields}")
        _print_added(added)
        return
    if str(file) == "camera" and not file.exists():
        raise typer.BadParameter(
            "name the tuning file: optisense library add camera --tuning FILE.json --like CAMERA",
            param_hint="--tuning",
        )
    _refuse(camera, "it needs --tuning")
    if file.suffix.lower() != ".ies":
        _refuse(ies, "it needs an .ies file")
        if description is not None:
            raise typer.BadParameter(
                "it needs an .ies file or --tuning", param_hint="--description"
            )
        _print_added(library.add_file(file, kind, name))
        return
    if kind not in (None, "light", "lights"):
        raise typer.BadParameter("an .ies file is a light", param_hint="--kind")
    _print_added(_from_ies(file, ies, name, description))


def _refuse(given: IesOptions | TuningOptions, why: str) -> None:
    """Raise typer.BadParameter if one of these options was given."""
    for option in given.model_fields_set - {"status"}:
        raise typer.BadParameter(why, param_hint=f"--{option}")


def _from_ies(file: Path, given: IesOptions, name: str | None, description: str | None) -> Added:
    """Store a light from an IES file; its colour and flux are asked for at a terminal."""
    from optisense import library
    from optisense.design.ies import read_ies
    from optisense.library.adding import check_new_name
    from optisense.library.storage import own_folder

    check_new_name(file.stem if name is None else name)
    profile = read_ies(file)
    if given.colour is None or given.flux is None:
        if not sys.stdin.isatty():
            missing = "--colour" if given.colour is None else "--flux"
            raise typer.BadParameter(
                "the IES file does not contain it; give this option", param_hint=missing
            )
        messages.print(
            f"{file.name} states {profile.lumens:.4g} lm; the light is stored in {own_folder()}"
        )
    colour = given.colour or typer.prompt("Colour (red, green, blue, white or R,G,B)", err=True)
    colour_name, rgb = library.parse_colour(str(colour))
    flux = given.flux
    if flux is None:
        flux = typer.prompt("Radiant flux in mW", type=float, err=True, value_proc=_asked_flux)
    return library.add_ies(
        file,
        library.TypicalLight(
            colour=rgb, flux=flux, wavelength=given.wavelength, current=given.current
        ),
        library.Source(
            status=given.status,
            source=given.source or "given when the light was added",
            date=date.today().isoformat(),
        ),
        colour_name=colour_name,
        name=name,
        description=description,
        window=given.window,
        package=given.package,
    )


def _asked_flux(text: str) -> float:
    try:
        return above_0(float(text))
    except ValueError:
        raise typer.BadParameter(f"'{text}' is not a number above 0") from None


def _from_tuning(
    what: Path, tuning: Path, given: TuningOptions, name: str | None, description: str | None
) -> Added:
    """Store a camera from libcamera's tuning file.

    Args:
        what: argument of the command: the word camera.
        given: data that the file lacks.
        name: name for designs; the file's name if None.
        description: description in one line.
    """
    from optisense import library
    from optisense.library.tuning import DAYLIGHT

    if str(what) not in ("camera", "cameras"):
        raise typer.BadParameter(
            "a tuning file describes a camera: optisense library add camera --tuning "
            f"{argument(tuning)}",
            param_hint="FILE",
        )
    if given.like is None:
        raise typer.BadParameter(
            "a tuning file does not contain the field of view; name a camera of the library with "
            "the same one, such as --like pi-v2",
            param_hint="--like",
        )
    return library.add_tuning(
        tuning,
        like=given.like,
        name=name,
        description=description,
        temperature=given.temperature or DAYLIGHT,
    )


def _print_added(added: Added) -> None:
    output.print(f"{added.kind} {added.name}: {added.file}")
    unsourced = added.entry.unsourced()
    if unsourced:
        output.print(f"warning: no source is given for: {', '.join(unsourced)}", style="yellow")
    output.print(f"Look at it:  optisense library show {added.name}", style="dim")
