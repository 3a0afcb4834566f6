"""``optisense new``: a built-in sensor as a design folder of one's own."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from optisense.cli.console import ends_well, output
from optisense.errors import OutputError


@ends_well
def new(
    name: Annotated[
        str,
        typer.Argument(metavar="NAME", help="A built-in sensor, such as gelsight-mini."),
    ],
    folder: Annotated[
        Path,
        typer.Argument(metavar="DIR", help="The folder to make; it must not exist or be empty."),
    ],
) -> None:
    """Start a design of your own from a built-in sensor."""
    from optisense.sensors import build, save_design

    design = build(name)
    if folder.is_file():
        raise OutputError("this is a file, not a folder", where=str(folder))
    if folder.is_dir() and any(folder.iterdir()):
        raise OutputError(
            "the folder is not empty", where=str(folder), hint="Name a folder that doesn't exist"
        )
    save_design(design, folder)
    output.print(f"{folder / 'design.yaml'}", markup=False)
    output.print(f"Look at it:  optisense check {folder}", markup=False, style="dim")
    output.print(f"Render it:   optisense render {folder} --out picture", markup=False, style="dim")
