"""``optisense export``: write the shapes to make, the places of the LEDs, and the parts to buy."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from optisense.cli.console import ends_well, messages, output
from optisense.cli.options import DesignArgument
from optisense.cli.output_folder import take_folder
from optisense.workshop import FORMATS


@ends_well
def export(
    design: DesignArgument,
    out: Annotated[Path, typer.Option("--out", "-o", metavar="DIR", help="Folder for the files.")],
    formats: Annotated[
        list[str] | None,
        typer.Option(
            "--format",
            "-f",
            metavar="|".join(FORMATS.names()),
            help="File format of the parts' shapes; stl if left out. May be given several "
            "times. step needs the extra 'step'.",
            show_default=False,
        ),
    ] = None,
    moulds: Annotated[
        bool, typer.Option("--moulds", help="Also write the moulds in which the gels are cast.")
    ] = False,
) -> None:
    """Export a design to the workshop: its parts in mm, its LEDs and a bill of materials.

    Writes each part as it is deformed by its cages, pick-and-place.csv with the place of each
    LED, and bill-of-materials.csv and .md into the folder.
    """
    wanted = [name.lower() for name in formats or ["stl"]]
    for name in wanted:
        if name not in FORMATS:
            raise typer.BadParameter(
                f"'{name}' is none of {', '.join(FORMATS.names())}", param_hint="--format"
            )

    from optisense.sensors import load

    sensor = load(design)
    for name in wanted:
        FORMATS.find(name).require()
    take_folder(out)

    from optisense.workshop import export as write
    from optisense.workshop.shapes import is_air, shapes

    for note in filter(None, (FORMATS.find(name).note for name in wanted)):
        messages.print(note, style="dim")
    notes: list[str] = []
    files = write(sensor, out, wanted, notes, with_moulds=moulds)
    sheets = [shape.name for shape in shapes(sensor) if not shape.is_solid]
    for file in files:
        output.print(str(file), markup=False)
    for note in notes:
        output.print(note, markup=False, style="dim")
    if sheets:
        output.print(
            f"sheets without thickness, not to be printed: {', '.join(sheets)}",
            markup=False,
            style="dim",
        )
    air = [name for name in sensor.parts if is_air(sensor, name)]
    if air:
        output.print(f"left out, since they are air: {', '.join(air)}", markup=False, style="dim")
    output.print("Lengths are in mm.", style="dim")
