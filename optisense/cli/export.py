"""``optisense export``: write the files for a workshop, or those for a robot simulator."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from optisense.cli.console import handles_errors, messages, output
from optisense.cli.options import DesignArgument, out_option
from optisense.cli.output_folder import take_folder
from optisense.errors import OptiSenseError, OutputError
from optisense.registry import Registry
from optisense.robots.formats import ROBOT_FORMATS
from optisense.workshop import FORMATS


@handles_errors
def export(
    design: DesignArgument,
    out: Annotated[Path, out_option("Folder for the files.")],
    formats: Annotated[
        list[str] | None,
        typer.Option(
            "--format",
            "-f",
            metavar="|".join(FORMATS.names()),
            help="File format of the parts' shapes; stl if left out. May be given several "
            "times. step needs the extra 'step'.",
        ),
    ] = None,
    moulds: Annotated[
        bool, typer.Option("--moulds", help="Also write the moulds in which the gels are cast.")
    ] = False,
    robots: Annotated[
        list[str] | None,
        typer.Option(
            "--for",
            metavar="|".join(ROBOT_FORMATS.names()),
            help="Write the files for a robot simulator instead. May be given several times.",
        ),
    ] = None,
    mass: Annotated[
        float | None,
        typer.Option(
            metavar="GRAMS",
            help="With --for: mass of the whole sensor in g; the sum of its parts if left out.",
        ),
    ] = None,
    density: Annotated[
        list[str] | None,
        typer.Option(
            metavar="PART=G/CM3",
            help="With --for: density of a part, in g/cm^3. May be given several times.",
        ),
    ] = None,
) -> None:
    """Export parts, LEDs and a bill of materials for the workshop, or a model for robot simulators.

    Writes each part as it is deformed by its cages, pick-and-place.csv with the place of each
    LED, and bill-of-materials.csv and .md into the folder. With --for, writes a model for a robot
    simulator instead: meshes in metres, mass and inertia, and frames of the camera and the skin.
    """
    if robots:
        if formats or moulds:
            raise typer.BadParameter(
                "it can't be combined with --format or --moulds", param_hint="--for"
            )
        _export_robot(design, out, robots, mass, density or [])
        return
    if mass is not None or density:
        raise typer.BadParameter(
            "it needs --for, as it describes models for robot simulators",
            param_hint="--mass" if mass is not None else "--density",
        )
    wanted = _known(formats or ["stl"], FORMATS, "--format", ROBOT_FORMATS, "--for")

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
        output.print(str(file))
    for note in notes:
        output.print(note, style="dim")
    if sheets:
        output.print(
            f"sheets without thickness, not to be printed: {', '.join(sheets)}", style="dim"
        )
    air = [name for name in sensor.parts if is_air(sensor, name)]
    if air:
        output.print(f"left out, since they are air: {', '.join(air)}", style="dim")
    output.print("Lengths are in mm.", style="dim")


def _export_robot(
    design: str, out: Path, wanted: list[str], mass: float | None, density: list[str]
) -> None:
    names = _known(wanted, ROBOT_FORMATS, "--for", FORMATS, "--format")
    densities = dict(_density(text) for text in density)
    if len(densities) < len(density):
        raise typer.BadParameter("a part is given twice", param_hint="--density")

    from optisense.robots import export_robot
    from optisense.sensors import load

    sensor = load(design)
    take_folder(out)
    notes: list[str] = []
    for file in export_robot(sensor, out, names, notes, mass=mass, densities=densities):
        output.print(str(file))
    for note in notes:
        output.print(note, style="dim")
    output.print("Lengths are in m, masses in kg.", style="dim")


def _known(
    names: list[str], formats: Registry[Any], option: str, others: Registry[Any], their_option: str
) -> list[str]:
    """Return names of formats in lower case.

    Args:
        others: formats of the other option, which a user may mean.
    """
    wanted = [name.lower() for name in names]
    for name in wanted:
        try:
            formats.find(name)
        except OutputError as error:
            meant = name not in formats and name in others
            hint = f"It is a {others.noun}: write {their_option} {name}" if meant else error.hint
            # Bad input has another exit code than output that can't be written.
            raise OptiSenseError(error.message, where=error.where or option, hint=hint) from None
    return wanted


def _density(text: str) -> tuple[str, float]:
    part, _, number = text.rpartition("=")
    try:
        return part.strip(), float(number)
    except ValueError:
        raise typer.BadParameter(
            f"'{text}' is no PART=G/CM3, such as housing=1.24", param_hint="--density"
        ) from None
