"""``optisense library``: the materials, lights and cameras that come with OptiSense."""

from __future__ import annotations

import json
from typing import Annotated, Any

import typer

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

    if kind is not None and kind.rstrip("s") not in KINDS:
        raise LibraryError(f"unknown kind '{kind}'", hint=f"Choose one of: {', '.join(KINDS)}")
    for each in KINDS if kind is None else (kind.rstrip("s"),):
        for name in library.names(each):
            output.print(f"{each:<10} {name}", markup=False)


@library_app.command("show")
@ends_well
def show_entry(
    name: Annotated[str, typer.Argument(metavar="NAME", help="As `library list` shows it.")],
) -> None:
    """Show an entry with the sources of its numbers."""
    from difflib import get_close_matches

    from rich.pretty import Pretty

    from optisense import library

    everything = {entry: kind for kind in KINDS for entry in library.names(kind)}
    if name not in everything:
        near = get_close_matches(name, everything, n=1)
        raise LibraryError(
            f"the library has no '{name}'",
            hint=f"Did you mean {near[0]}?" if near else "See: optisense library list",
        )
    entry: Any = getattr(library, everything[name])(name)
    output.print(f"{everything[name]} {name}", style="bold", markup=False)
    content = entry.model_dump(mode="json", exclude_none=True)
    if output.is_terminal:
        output.print(Pretty(content, expand_all=True))
    else:
        print(json.dumps(content, indent=2))
