"""``optisense library``: the materials, lights and cameras that come with OptiSense."""

from __future__ import annotations

from typing import Annotated

import typer
from rich.table import Table

from optisense.cli.console import ends_well, output
from optisense.errors import LibraryError

KINDS = ("material", "coating", "light", "camera")

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
    """List what the library holds."""
    from optisense import library

    table = Table("kind", "name", "description", box=None, pad_edge=False)
    for each in KINDS if kind is None else (kind,):
        for name in library.names(each):
            entry = library.entry(each, name)
            table.add_row(each, name, entry.description)
    output.print(table)


@library_app.command("show")
@ends_well
def show_entry(
    name: Annotated[str, typer.Argument(metavar="NAME", help="As `library list` shows it.")],
) -> None:
    """Show an entry with the sources of its numbers."""
    from difflib import get_close_matches

    from optisense import library

    kinds = [kind for kind in KINDS if name in library.names(kind)]
    if not kinds:
        known = [known for kind in KINDS for known in library.names(kind)]
        near = get_close_matches(name, known, n=1)
        raise LibraryError(
            f"the library has no '{name}'",
            hint=f"Did you mean {near[0]}?" if near else "See: optisense library list",
        )
    for kind in kinds:
        entry = library.entry(kind, name)
        output.print(f"{kind} {name}", style="bold", markup=False)
        output.print(entry.description, markup=False)
        content = entry.model_dump(mode="json", exclude_none=True)
        sources = content.pop("sources")
        content.pop("description")
        for field, value in {**content.pop("value"), **content}.items():
            output.print(f"  {field}: {_short(value)}", markup=False)
        output.print("where its numbers come from", style="bold")
        for field, source in sources.items():
            date = f" ({source['date']})" if "date" in source else ""
            output.print(f"  {field}: {source['status']}, {source['source']}{date}", markup=False)


def _short(value: object) -> str:
    """A value on one line, without Python's quotes."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key}: {_short(inner)}" for key, inner in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(_short(inner) for inner in value) + "]"
    return f"{value:g}" if isinstance(value, float) else str(value)
