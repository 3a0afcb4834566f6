"""``optisense library``: show and extend the materials, lights and cameras that designs can
name.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.table import Table

from optisense.cli.console import PlainConsole, ends_well, messages, output
from optisense.errors import LibraryError

if TYPE_CHECKING:
    from optisense.library import Added, AnyEntry

KINDS = ("material", "coating", "light", "camera")
PIPED_WIDTH = 240
"""Characters per line of a table that is piped to another program. No cell of the library's tables
is wrapped at this width, so that every entry stays on one line.
"""

KindOption = Annotated[
    str | None,
    typer.Option("--kind", metavar="KIND", help=f"One of: {', '.join(KINDS)}.", show_default=False),
]

library_app = typer.Typer(
    help="Materials, coatings, lights and cameras that designs can name.", no_args_is_help=True
)


@library_app.command("list")
@ends_well
def list_entries(
    kind: Annotated[
        str | None,
        typer.Argument(metavar="[KIND]", help=f"One of: {', '.join(KINDS)}.", show_default=False),
    ] = None,
) -> None:
    """List the entries of the library, including your own."""
    from optisense import library
    from optisense.library.facts import summary

    table = Table(box=None, pad_edge=False)
    for title in ("kind", "name", "in short", ""):
        table.add_column(title, no_wrap=True)
    table.add_column("description")
    broken: list[LibraryError] = []
    for each in KINDS if kind is None else (kind,):
        for name in library.names(each):
            try:
                entry = library.entry(each, name)
                row = (summary(entry), "yours" if library.is_own(each, name) else "")
            except LibraryError as error:
                broken.append(error)
                continue
            table.add_row(each, name, *row, entry.description)
    _print_table(table)
    for problem in broken:
        messages.print(f"left out: {problem}", markup=False, style="yellow")


@library_app.command("show")
@ends_well
def show_entry(
    name: Annotated[
        str,
        typer.Argument(metavar="NAME", help="The name of the entry, as `library list` shows it."),
    ],
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            "-o",
            metavar="FILE.png",
            help="Also draw the entry into this file: a ball of a material or coating, the "
            "intensity of a light by angle, or the field of view of a camera.",
            show_default=False,
        ),
    ] = None,
    as_yaml: Annotated[
        bool,
        typer.Option(
            "--yaml",
            help="Print the entry as a YAML file, which can be changed and added with `library "
            "add`.",
        ),
    ] = False,
) -> None:
    """Show an entry with the sources of its numbers, and draw it."""
    from optisense import library

    if out is not None and out.suffix.lower() != ".png":
        raise typer.BadParameter(f"'{out}' must end in .png", param_hint="--out")
    kinds = [kind for kind in KINDS if name in library.names(kind)]
    if not kinds:
        from optisense.near import suggestion

        known = [known for kind in KINDS for known in library.names(kind)]
        hint = suggestion(name, known, limit=0) or "See: optisense library list"
        raise LibraryError(f"the library has no '{name}'", hint=hint)
    for kind in kinds:
        entry = library.entry(kind, name)
        if as_yaml:
            from optisense.design.yaml_writer import to_yaml
            from optisense.library.own_parts import HEADS
            from optisense.library.reading import KINDS as MODELS

            head = next(HEADS[each] for each in MODELS if each == kind)
            output.print(to_yaml(entry, head), end="", markup=False)
        else:
            _describe(f"{kind} {name}", entry, own=library.is_own(kind, name))
        if out is not None:
            from optisense.library import previews

            previews.save(previews.draw(name, entry), out)
            messages.print(f"picture: {out}", markup=False)


@library_app.command("add")
@ends_well
def add_entry(
    file: Annotated[
        Path,
        typer.Argument(
            metavar="FILE",
            help="An entry (.yaml, as `library show --yaml` prints), an .ies, or the word camera "
            "with --tuning.",
        ),
    ],
    kind: KindOption = None,
    name: Annotated[
        str | None,
        typer.Option(
            metavar="NAME", help="Name of the entry in designs; the file's name if left out."
        ),
    ] = None,
    colour: Annotated[
        str | None,
        typer.Option(
            metavar="COLOUR", help="With an .ies: red, green, blue, white, or R,G,B from 0 to 1."
        ),
    ] = None,
    flux: Annotated[
        float | None, typer.Option(metavar="MW", help="With an .ies: radiant flux in mW.")
    ] = None,
    wavelength: Annotated[
        float | None, typer.Option(metavar="NM", help="With an .ies: dominant wavelength in nm.")
    ] = None,
    current: Annotated[
        float | None, typer.Option(metavar="MA", help="With an .ies: current in mA at this flux.")
    ] = None,
    window: Annotated[
        str | None,
        typer.Option(metavar="WxH", help="With an .ies: size of its opening in mm, as 2.4x2.4."),
    ] = None,
    package: Annotated[
        str | None,
        typer.Option(metavar="WxLxH", help="With an .ies: size of its body in mm, as 2.8x3.5x1.9."),
    ] = None,
    description: Annotated[
        str | None,
        typer.Option(metavar="TEXT", help="With an .ies or --tuning: what it is, in a line."),
    ] = None,
    source: Annotated[
        str | None, typer.Option(metavar="TEXT", help="With an .ies: where these numbers are from.")
    ] = None,
    status: Annotated[
        str,
        typer.Option(
            metavar="STATUS",
            help="With an .ies: measured, datasheet, sourced, derived or assumed.",
        ),
    ] = "assumed",
    tuning: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.json",
            help="A tuning file of libcamera, from which noise, shading, colours and tone "
            "curve are read.",
            show_default=False,
        ),
    ] = None,
    like: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="With --tuning: the camera of the library whose field of view and pixels the "
            "new entry takes.",
        ),
    ] = None,
    temperature: Annotated[
        float | None,
        typer.Option(metavar="K", help="With --tuning: colour temperature in K; 5000 if left out."),
    ] = None,
) -> None:
    """Check an entry of your own and store it in your library folder.

    The folder is $OPTISENSE_LIBRARY, or else optisense/library in your configuration folder.
    """
    from optisense import library

    given = {
        "--colour": colour, "--flux": flux, "--wavelength": wavelength, "--current": current,
        "--window": window, "--package": package, "--description": description,
        "--source": source,
    }  # fmt: skip
    if tuning is None:
        if str(file) == "camera" and not file.exists():
            raise typer.BadParameter(
                "name the tuning file: library add camera --tuning FILE.json --like CAMERA",
                param_hint="--tuning",
            )
        for option, value in (("--like", like), ("--temperature", temperature)):
            if value is not None:
                raise typer.BadParameter("is for --tuning only", param_hint=option)
    if tuning is not None:
        from optisense.cli.library_tuning import add_tuning_file

        del given["--description"]
        _refuse(given, "--tuning has none")
        added = add_tuning_file(
            file, tuning, like=like, temperature=temperature, name=name, description=description
        )
    elif file.suffix.lower() != ".ies":
        _refuse(given, "is for .ies files only")
        added = library.add_file(file, kind, name)
    else:
        if kind not in (None, "light", "lights"):
            raise typer.BadParameter("an .ies file is a light", param_hint="--kind")
        from optisense.cli.library_ies import add_ies_file

        added = add_ies_file(
            file,
            name=name,
            colour=colour,
            flux=flux,
            wavelength=wavelength,
            current=current,
            window=window,
            package=package,
            description=description,
            source=source,
            status=status,
        )
    _say_added(added)


def _refuse(given: dict[str, Any], why: str) -> None:
    """Refuse options that were given.

    Raises:
        typer.BadParameter: an option was given.
    """
    for option, value in given.items():
        if value is not None:
            raise typer.BadParameter(why, param_hint=option)


def _say_added(added: Added) -> None:
    output.print(f"{added.kind} {added.name}: {added.file}", markup=False)
    unsourced = added.entry.unsourced()
    if unsourced:
        output.print(
            f"no source is given for: {', '.join(unsourced)}", markup=False, style="yellow"
        )
    output.print(f"Look at it:  optisense library show {added.name}", markup=False, style="dim")


def _print_table(table: Table) -> None:
    """Print a table; if a program reads the output, each row is on one line."""

    if output.is_terminal:
        output.print(table, soft_wrap=False)
    else:
        PlainConsole(file=output.file, width=PIPED_WIDTH, highlight=False).print(table)


def _describe(title: str, entry: AnyEntry, own: bool) -> None:
    """Print an entry, and the source of each number."""
    from optisense.library.facts import consequences, facts

    output.print(title + (" (yours)" if own else ""), style="bold", markup=False)
    output.print(entry.description, markup=False)
    if entry.maker:
        output.print(f"made by {entry.maker}", markup=False)
    table = Table(box=None, pad_edge=False)
    for title in ("", "value", "status"):
        table.add_column(title, no_wrap=True)
    table.add_column("where it comes from")
    for fact in facts(entry):
        status = date = text = ""
        if fact.source is not None:
            status, text = fact.source.status.value, fact.source.source
            date = f" ({fact.source.date})" if fact.source.date else ""
        table.add_row(fact.name, fact.value, status, text + date)
    output.print()
    _print_table(table)
    lines = consequences(entry)
    if lines:
        output.print()
    for line in lines:
        output.print(line, markup=False)
