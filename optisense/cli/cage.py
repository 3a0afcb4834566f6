"""``optisense cage``: cages that bend parts; show, add, move, refine, and set a search's range."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, cast

import typer
from rich.table import Table

from optisense.cli.console import handles_errors, messages, output
from optisense.cli.options import DesignArgument, out_option
from optisense.commands.options import MOST_MARGIN
from optisense.errors import DesignError
from optisense.text import argument

if TYPE_CHECKING:
    from optisense.design import SensorDesign

cage_app = typer.Typer(
    help="Bend parts of a design by cages of control points.", no_args_is_help=True
)

CageArgument = Annotated[
    str, typer.Argument(metavar="CAGE", help="The cage's name, as `cage show` lists it.")
]
OutOption = Annotated[
    Path,
    out_option(
        "Where to write the changed design: a new folder, or the design's own (its "
        "design.yaml is written anew; your comments in it stay)."
    ),
]
MoveOption = Annotated[
    list[str],
    typer.Option(
        "--point",
        "-p",
        metavar="WHICH=DX,DY,DZ",
        help="A control point, by its number or its indices along x, y and z, and its "
        "displacement in mm: 13=0,0,6 or 1,1,2=0,0,6. A * stands for all points along "
        "an axis, as in 1,*,2=0,0,6. May be given several times.",
    ),
]


@cage_app.command("show")
@handles_errors
def show(
    design: DesignArgument,
    cage: Annotated[
        str | None,
        typer.Argument(
            metavar="[CAGE]",
            help="The name of a cage, whose control points are listed; all cages if left out.",
        ),
    ] = None,
) -> None:
    """List the cages of a design, or the control points of one."""
    from optisense.sensors import load

    sensor = load(design)
    if cage is not None:
        _show_points(sensor, cage)
        return
    table = Table("cage", "parts", "points", "shape", box=None, pad_edge=False)
    for name, entry in sensor.cages.items():
        nx, ny, nz = entry.resolution
        table.add_row(name, ", ".join(entry.parts), f"{nx} x {ny} x {nz}", _shape(sensor, name))
    output.print(table)


@cage_app.command("add")
@handles_errors
def add(
    design: DesignArgument,
    cage: Annotated[str, typer.Argument(metavar="CAGE", help="A name for the cage.")],
    out: OutOption,
    part: Annotated[
        list[str],
        typer.Option(
            metavar="PART",
            help="A part that the cage deforms. May be given several times; put parts that "
            "touch into one cage.",
        ),
    ],
    resolution: Annotated[
        str, typer.Option(metavar="NXxNYxNZ", help="Number of control points along x, y and z.")
    ] = "3x3x3",
    margin: Annotated[
        float,
        typer.Option(
            min=0.0,
            max=MOST_MARGIN,
            metavar="MM",
            help="Distance between the parts and the sides of the cage, mm.",
        ),
    ] = 0.0,
) -> None:
    """Put a cage around parts. Their shapes do not change until you move its points."""
    from optisense.design.cage_edit import add_cage

    points = _resolution(resolution)
    _edit(design, lambda sensor: add_cage(sensor, cage, part, points, margin), cage, out)


@cage_app.command("remove")
@handles_errors
def remove(design: DesignArgument, cage: CageArgument, out: OutOption) -> None:
    """Remove a cage. Its parts get their undeformed shapes back."""
    from optisense.design.cage_edit import remove_cage

    _edit(design, lambda sensor: remove_cage(sensor, cage), None, out)


@cage_app.command("refine")
@handles_errors
def refine(
    design: DesignArgument,
    cage: CageArgument,
    out: OutOption,
    resolution: Annotated[
        str, typer.Option(metavar="NXxNYxNZ", help="Number of control points along x, y and z.")
    ],
) -> None:
    """Give a cage more control points; the shape stays exactly the same."""
    from optisense.design.cage_edit import refine_cage

    points = _resolution(resolution)
    _edit(design, lambda sensor: refine_cage(sensor, cage, points), cage, out)


@cage_app.command("move")
@handles_errors
def move(
    design: DesignArgument,
    cage: CageArgument,
    out: OutOption,
    point: MoveOption,
    of: Annotated[
        str,
        typer.Option(
            metavar="points|c_min|c_max",
            help="What moves: the present shape (points), or an end of its range.",
        ),
    ] = "points",
) -> None:
    """Move control points. A shape that folds or cuts into other parts is not written."""
    if of not in ("points", "c_min", "c_max"):
        raise typer.BadParameter(f"'{of}' is none of points, c_min, c_max", param_hint="--of")
    moves = _moves(point, "--point")
    _edit(design, lambda sensor: _moved(sensor, cage, moves, of), cage, out)


@cage_app.command("range")
@handles_errors
def set_range(
    design: DesignArgument,
    cage: CageArgument,
    out: OutOption,
    low: Annotated[
        list[str] | None,
        typer.Option(
            "--min",
            metavar="WHICH=DX,DY,DZ",
            help="A displacement of c_min relative to the present shape, in mm, written as for "
            "`cage move`. May be given several times.",
        ),
    ] = None,
    high: Annotated[
        list[str] | None,
        typer.Option(
            "--max",
            metavar="WHICH=DX,DY,DZ",
            help="The same for c_max.",
        ),
    ] = None,
    blend: Annotated[
        float,
        typer.Option(
            min=0.0,
            max=1.0,
            metavar="A",
            help="The present shape between both ends: 0 is c_min, 1 is c_max.",
        ),
    ] = 0.0,
) -> None:
    """Give a cage two end shapes, c_min and c_max, between which a search may vary it."""
    from optisense.design import cage_edit

    moves = {"c_min": _moves(low or [], "--min"), "c_max": _moves(high or [], "--max")}

    def ranged(sensor: SensorDesign) -> SensorDesign:
        sensor = cage_edit.set_range(sensor, cage, blend=blend)
        for end, steps in moves.items():
            sensor = _moved(sensor, cage, steps, end)
        _check_ends(sensor, cage)
        return sensor

    _edit(design, ranged, cage, out)


@cage_app.command("blend")
@handles_errors
def blend(
    design: DesignArgument,
    cage: CageArgument,
    share: Annotated[
        float, typer.Argument(min=0.0, max=1.0, metavar="A", help="0 is c_min, 1 is c_max.")
    ],
    out: OutOption,
) -> None:
    """Set the shape between c_min and c_max, with the same share for all control points."""
    from optisense.design import get_value
    from optisense.design.cage import as_array
    from optisense.design.cage_edit import set_range

    def blended(sensor: SensorDesign) -> SensorDesign:
        entry = get_value(sensor, f"cages.{cage}")
        if entry.c_min is None or entry.c_max is None:
            raise DesignError(
                f"cage '{cage}' has no c_min and c_max",
                hint=f"Set them with: optisense cage range {argument(design)} {cage} ...",
            )
        ends = as_array(entry.c_min), as_array(entry.c_max)
        return set_range(sensor, cage, *ends, blend=share)

    _edit(design, blended, cage, out)


@cage_app.command("settle")
@handles_errors
def settle(design: DesignArgument, cage: CageArgument, out: OutOption) -> None:
    """Turn a blend of c_min and c_max into control points that can be moved; the range stays."""
    from optisense.design.cage_edit import settle_cage

    _edit(design, lambda sensor: settle_cage(sensor, cage), cage, out)


def _resolution(text: str) -> tuple[int, int, int]:
    match = re.fullmatch(r"\s*(\d{1,3})\s*[xX×]\s*(\d{1,3})\s*[xX×]\s*(\d{1,3})\s*", text)
    if match is None:
        raise typer.BadParameter(f"'{text}' is not like 3x3x3", param_hint="--resolution")
    return int(match[1]), int(match[2]), int(match[3])


def _moves(texts: list[str], option: str) -> list[tuple[str, tuple[float, float, float]]]:
    moves = []
    for text in texts:
        which, sign, way = text.partition("=")
        try:
            x, y, z = (float(part) for part in way.split(","))
        except ValueError:
            sign = ""
        if not sign:
            raise typer.BadParameter(f"'{text}' is not like 1,*,2=0,0,6", param_hint=option)
        moves.append((which, (x, y, z)))
    return moves


def _moved(
    design: SensorDesign, cage: str, moves: list[tuple[str, tuple[float, float, float]]], shape: str
) -> SensorDesign:
    """Return a design with control points of a shape of a cage moved, one move after the other."""
    from optisense.design.cage_edit import Shape, move_points

    for which, way in moves:
        design = move_points(design, cage, {which: way}, cast(Shape, shape))
    return design


def _shape(design: SensorDesign, name: str) -> str:
    """Return one line on the positions of a cage's points."""
    import numpy as np

    cage = design.cages[name]
    moved = float(np.linalg.norm(cage.offsets_at_rest(), axis=1).max())
    text = f"moved by up to {moved:.4g} mm" if moved > 1e-9 else "at rest"
    if isinstance(cage.blend, float):
        return f"{text}, blend {cage.blend:.4g}"
    return text if cage.blend is None else f"{text}, a blend for each point"


def _show_points(design: SensorDesign, name: str) -> None:
    import numpy as np

    from optisense.design import get_value
    from optisense.design.cage import Cage, as_array

    cage: Cage = get_value(design, f"cages.{name}")
    nx, ny, nz = cage.resolution
    output.print(f"{name}: {nx} x {ny} x {nz} control points over {', '.join(cage.parts)}; "
                 f"{_shape(design, name)}")  # fmt: skip
    now, offsets = cage.current_points(), cage.offsets_at_rest()
    rows = [["point", "i,j,k", "x, y, z (mm)", "moved by"]]
    ends = None
    if cage.c_min is not None and cage.c_max is not None:
        ends = as_array(cage.c_min), as_array(cage.c_max)
        rows[0] += ["c_min", "c_max"]
    for row, place in enumerate(np.ndindex(cage.resolution)):
        cells = [str(row), ",".join(map(str, place)), _numbers(now[row])]
        cells.append(_numbers(offsets[row]) if np.abs(offsets[row]).max() > 1e-9 else "-")
        if ends is not None:
            cells += [_numbers(ends[0][row]), _numbers(ends[1][row])]
        rows.append(cells)
    widths = [max(len(cells[k]) for cells in rows) for k in range(len(rows[0]))]
    for cells in rows:  # rich's tables would break lines in a narrow terminal
        line = "  ".join(cell.ljust(width) for cell, width in zip(cells, widths, strict=True))
        output.print(line.rstrip())


def _numbers(values: object) -> str:
    # Rounding errors of a refined cage would show as 4e-16.
    return ", ".join(f"{round(value, 9) + 0.0:.5g}" for value in cast("list[float]", values))


def _check_ends(design: SensorDesign, name: str) -> None:
    """Print the problems of both ends of a range; a search may find good shapes in between."""
    from optisense.design import set_value
    from optisense.design.cage_checks import cage_problems

    for end, share in (("c_min", 0.0), ("c_max", 1.0)):
        for problem in cage_problems(set_value(design, f"cages.{name}.blend", share)):
            messages.print(f"warning, at {end}: {problem}", style="yellow")


def _edit(
    source: str, change: Callable[[SensorDesign], SensorDesign], cage: str | None, out: Path
) -> None:
    """Read a design, change it, check the shapes and write it, to its own folder or a new one."""
    from optisense.design.cage_checks import cage_problems
    from optisense.design.problems import raise_problems
    from optisense.design.storage import digest_of
    from optisense.sensors import load, save_design

    own = Path(source)
    own = own.parent if own.is_file() else own
    is_own = own.is_dir() and out.is_dir() and out.samefile(own)
    digest = digest_of(own) if is_own else None  # before the files are read
    design = change(load(source))
    problems = cage_problems(design)
    raise_problems(problems, f"design '{design.name}'")
    for problem in problems:
        messages.print(f"warning: {problem}", style="yellow")
    save_design(design, out, new=not is_own, digest=digest)
    if cage is not None:
        output.print(f"cage {cage}: {_shape(design, cage)}")
    output.print(f"{out / 'design.yaml'}")
