"""``optisense library``: show and extend the materials, lights and cameras of designs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from optisense.cli.console import PlainConsole, handles_errors, messages, output
from optisense.cli.library_add import add_entry
from optisense.errors import LibraryError

if TYPE_CHECKING:
    from optisense.library import AnyEntry

KINDS = ("material", "coating", "light", "camera")
PIPED_WIDTH = 240
"""Characters per line of a table that is piped to another program. No cell of the library's tables
is wrapped at this width, so that every entry stays on one line.
"""

library_app = typer.Typer(
    help="List, show and add materials, coatings, lights and cameras for designs.",
    no_args_is_help=True,
)


@library_app.command("list")
@handles_errors
def list_entries(
    kind: Annotated[
        str | None,
        typer.Argument(metavar="[KIND]", help=f"One of: {', '.join(KINDS)}."),
    ] = None,
) -> None:
    """List the entries of the library, including your own."""
    from optisense import library
    from optisense.library.facts import summary

    table = Table(box=None, pad_edge=False)
    for title in ("kind", "name", "summary", ""):
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
        messages.print(f"warning: an entry is left out: {problem}", style="yellow")


@library_app.command("show")
@handles_errors
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
            from optisense.library.storage import HEADS
            from optisense.library.storage import KINDS as MODELS

            head = next(HEADS[each] for each in MODELS if each == kind)
            output.print(to_yaml(entry, head), end="")
        else:
            _describe(f"{kind} {name}", entry, own=library.is_own(kind, name))
        if out is not None:
            from optisense.library import previews

            previews.save(previews.draw(name, entry), out)
            messages.print(f"picture: {out}")


library_app.command("add")(add_entry)


def _print_table(table: Table) -> None:
    """Print a table; if a program reads the output, each row is on one line."""

    if output.is_terminal:
        output.print(table, soft_wrap=False)
    else:
        PlainConsole(file=output.file, width=PIPED_WIDTH).print(table)


def _describe(title: str, entry: AnyEntry, own: bool) -> None:
    """Print an entry, and the source of each number."""
    from optisense.library.facts import consequences, facts

    output.print(title + (" (yours)" if own else ""), style="bold")
    output.print(entry.description)
    if entry.maker:
        output.print(f"made by {entry.maker}")
    table = Table(box=None, pad_edge=False)
    for title in ("", "value", "status"):
        table.add_column(title, no_wrap=True)
    table.add_column("source")
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
        output.print(line)
