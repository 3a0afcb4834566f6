"""``optisense contacts``: find the contacts in photographs, to correct them."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from optisense.cli.compare import PhotosArgument
from optisense.cli.console import handles_errors, output, print_notes, table_of
from optisense.cli.options import out_option
from optisense.commands.comparing import PhotographOptions


@handles_errors
def contacts(
    photos: PhotosArgument,
    out: Annotated[Path, out_option("The page to write.", "FILE")],
    *,
    options: PhotographOptions,
) -> None:
    """Find the contacts in photographs of a real sensor, and write a page to correct them on.

    On the page you can drag the circles around the contacts, and save them as presses.csv.
    """
    if out.is_dir():
        raise typer.BadParameter(f"'{out}' is a folder", param_hint="--out")
    from optisense.calibration import read_photographs
    from optisense.calibration.seen_contacts import ContactFinder
    from optisense.cli.output_folder import ensure_writable
    from optisense.report.comparison import write_contacts

    photographs = read_photographs(photos, options.ball).scaled()
    ensure_writable(out.parent)
    finder = ContactFinder(photographs)
    found = finder.contacts(refine=not options.as_labelled)
    notes = [*photographs.warnings(), *finder.doubts()]
    write_contacts(out, photos.name, photographs, found, notes)
    print_notes(notes)
    table = table_of("press", "column", "row", "radius (pixels)")
    for press, place in zip(photographs.presses, found, strict=True):
        if place is None:
            table.add_row(press.name, "none", "", "")
            continue
        numbers = (*place.centre, place.radius)
        table.add_row(press.name, *(f"{value / photographs.scale:.1f}" for value in numbers))
    output.print(table)
    output.print(f"page: {out}")
