"""``optisense task``: measure what a robot could read from a sensor."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from optisense import tasks
from optisense.cli.console import handles_errors, messages, output, print_json, table_of
from optisense.cli.options import (
    DesignArgument,
    VariantOption,
    json_option,
    out_option,
    parse_contacts,
)
from optisense.cli.progress import progress_line
from optisense.cli.sampling import LOADING, load_sensor, sample_progress
from optisense.commands.sampling import CylinderOptions, ReconstructionOptions, SampleOptions
from optisense.writing import inside

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from optisense.optics import OpticalModel
    from optisense.tasks import PerceptionResult, PerceptionTask, ReconstructionResult

RESULT = "result.json"
FIGURE = "figure.png"

task_app = typer.Typer(
    help="Measure how well angles, radii, forces or shapes can be read from a sensor's pictures.",
    no_args_is_help=True,
)

OutOption = Annotated[
    Path | None,
    out_option(
        "Folder for result.json and figure.png. Samples are kept there, so that the same "
        "command continues when it was stopped."
    ),
]
JsonOption = Annotated[bool, json_option("Print JSON instead of a table.")]
BallOption = Annotated[float, typer.Option(min=0.1, metavar="MM", help="Radius of the ball, mm.")]


@task_app.command()
@handles_errors
def misalignment(
    design: DesignArgument,
    angle: Annotated[
        float,
        typer.Option(
            "--range", min=0.1, max=44.0, metavar="DEGREES", help="The largest angle, degrees."
        ),
    ] = 10.0,
    depth: Annotated[
        float, typer.Option(min=0.01, metavar="MM", help="Depth of the plane in the middle, mm.")
    ] = 0.8,
    crop: Annotated[
        float,
        typer.Option(
            min=0.01,
            max=1.0,
            metavar="PART",
            help="Share of the picture's width and height whose colours are averaged.",
        ),
    ] = 0.25,
    *,
    options: SampleOptions,
    out: OutOption = None,
    as_json: JsonOption = False,
    variant: VariantOption = "auto",
) -> None:
    """Estimate the angle between the sensor and a plane, from the mean colour in the middle."""
    wanted = {"misalignment": lambda: tasks.Misalignment(range=angle, depth=depth, crop=crop)}
    _perceive(design, wanted, options, out, as_json, variant)


@task_app.command("cylinder-radius")
@handles_errors
def cylinder_radius(
    design: DesignArgument,
    depth: Annotated[
        float, typer.Option(min=0.01, metavar="MM", help="Depth of all presses, mm.")
    ] = 0.5,
    *,
    options: CylinderOptions,
    out: OutOption = None,
    as_json: JsonOption = False,
    variant: VariantOption = "auto",
) -> None:
    """Estimate the radius of a cylinder, from the standard deviation of colours in the contact."""
    least, most = options.radius
    wanted = {"cylinder-radius": lambda: tasks.CylinderRadius(least=least, most=most, depth=depth)}
    _perceive(design, wanted, options, out, as_json, variant)


@task_app.command()
@handles_errors
def force(
    design: DesignArgument,
    ball: BallOption = 3.0,
    depth: Annotated[
        float,
        typer.Option(
            min=0.11, metavar="MM", help="The largest depth of a press, mm; the smallest is 0.1 mm."
        ),
    ] = 1.0,
    *,
    options: SampleOptions,
    out: OutOption = None,
    as_json: JsonOption = False,
    variant: VariantOption = "auto",
) -> None:
    """Estimate the force on a pressed ball, from the standard deviation of the colours."""
    wanted = {"force": lambda: tasks.BallForce(radius=ball, most=depth)}
    _perceive(design, wanted, options, out, as_json, variant)


@task_app.command()
@handles_errors
def shear(
    design: DesignArgument,
    ball: BallOption = 3.0,
    depth: Annotated[
        float,
        typer.Option(
            min=0.41, metavar="MM", help="The largest depth of a press, mm; the smallest is 0.4 mm."
        ),
    ] = 1.0,
    drag: Annotated[
        float,
        typer.Option(
            min=0.01, metavar="MM", help="The largest distance by which the ball is dragged, mm."
        ),
    ] = 0.4,
    *,
    options: SampleOptions,
    out: OutOption = None,
    as_json: JsonOption = False,
    variant: VariantOption = "auto",
) -> None:
    """Estimate the shear force on a dragged ball, from the motion of the markers in the picture."""
    wanted = {"shear": lambda: tasks.BallShear(radius=ball, most=depth, farthest=drag)}
    _perceive(design, wanted, options, out, as_json, variant)


@task_app.command()
@handles_errors
def snr(
    design: DesignArgument,
    *,
    options: SampleOptions,
    out: OutOption = None,
    as_json: JsonOption = False,
    variant: VariantOption = "auto",
) -> None:
    """Run misalignment and cylinder-radius: the signal-to-noise ratio, which needs no model, and
    the error of each.
    """
    both: dict[str, Callable[[], PerceptionTask]] = {
        "misalignment": lambda: tasks.Misalignment(),
        "cylinder-radius": lambda: tasks.CylinderRadius(),
    }
    _perceive(design, both, options, out, as_json, variant)


@task_app.command()
@handles_errors
def reconstruction(
    design: DesignArgument,
    thing: Annotated[
        list[str] | None,
        typer.Option(
            "--object",
            metavar="KIND:SIZE@U,V:DEPTH",
            help="What is reconstructed, written as a contact. May be given several times.  "
            "[default: a ball of 3 mm, a cylinder of 2 mm, a pyramid of 30 degrees]",
        ),
    ] = None,
    *,
    options: ReconstructionOptions,
    out: Annotated[Path | None, out_option("Folder for result.json and figure.png.")] = None,
    as_json: JsonOption = False,
    variant: VariantOption = "auto",
) -> None:
    """Reconstruct shapes of objects: errors of normals (degrees) and depth (mm)."""
    texts = thing or []
    contacts = dict(zip(texts, parse_contacts(texts), strict=True))
    if len(contacts) < len(texts):
        raise typer.BadParameter("an object is given twice", param_hint="--object")
    with progress_line() as line:
        line.begin(LOADING)
        settings = tasks.ReconstructionSettings(**options.model_dump())
        model = load_sensor(line, design, out, variant, settings.resolution)
        show = sample_progress(line, model, "pictures", "comparing")
        result = tasks.reconstruct(model, settings, contacts or None, show)
    values = _with_notes(result.to_dict(), model, settings.resolution)
    if out is not None:
        from optisense.tasks.figures import draw_reconstruction

        _write(out, values, draw_reconstruction(result, model.design.camera.axes()))
    if as_json:
        print_json(values)
    else:
        print_reconstruction(result)
        _print_folder(out)


def _perceive(
    design: str,
    wanted: Mapping[str, Callable[[], PerceptionTask]],
    options: SampleOptions,
    out: Path | None,
    as_json: bool,
    variant: str,
) -> None:
    """Run tasks, which are made by name, one after the other; several have a folder each."""
    results, values = [], []
    with _kept_samples_note(out), progress_line() as line:
        line.begin(LOADING)
        settings = tasks.SampleSettings(**options.settings())
        made = [make() for make in wanted.values()]
        model = load_sensor(line, design, out, variant, settings.resolution)
        from optisense.tasks.figures import draw_perception

        for task in made:
            folder = out if out is None or len(wanted) == 1 else inside(out, task.name)
            show = sample_progress(line, model, task.name, f"{task.name}: reading the samples")
            results.append(tasks.perceive(task, model, settings, options.neighbours, folder, show))
            values.append(_with_notes(results[-1].to_dict(), model, settings.resolution))
            if folder is not None:
                _write(folder, values[-1], draw_perception(results[-1]))
    if as_json:
        print_json(values[0] if len(values) == 1 else {"tasks": values})
    else:
        print_perception(results)
        _print_folder(out)


@contextmanager
def _kept_samples_note(out: Path | None) -> Iterator[None]:
    """Print after Ctrl-C that finished samples are kept."""
    try:
        yield
    except KeyboardInterrupt:
        if out is not None:
            messages.print("finished samples are kept; the same command continues")
        raise


def _with_notes(
    values: dict[str, Any], model: OpticalModel, resolution: tuple[int, int] | None
) -> dict[str, Any]:
    """Return a result for JSON with the notes on the shape of its pictures."""
    return {**values, "notes": model.design.camera.shape_notes(resolution)}


def _write(folder: Path, values: dict[str, Any], figure: Figure) -> None:
    from optisense.writing import write_json, written_whole

    write_json(folder / RESULT, values)
    with written_whole(folder / FIGURE) as path:
        figure.savefig(path, dpi=110)


def _print_folder(out: Path | None) -> None:
    if out is not None:
        output.print(f"results: {out}")


def print_perception(results: Iterable[PerceptionResult]) -> None:
    """Print a row for each task."""
    heads = ("mean error", "of folds", "baseline error", "signal to noise", "samples")
    table = table_of("task", *heads)
    for result in results:
        reading = result.reading
        table.add_row(
            result.task,
            f"{reading.error:.3g} {result.unit}",
            f"± {reading.spread:.2g}",
            f"{reading.guess:.3g} {result.unit}",
            f"{result.snr:.3g}",
            f"{len(result.samples.targets)}",
        )
    output.print(table)


def print_reconstruction(result: ReconstructionResult) -> None:
    """Print a row for each object, and their mean: degrees of normals, and mm of depths."""
    heads = ("normals (°)", "if flat (°)", "ring (°)", "depth (mm)", "ring (mm)")
    table = table_of("object", *heads, "deepest (mm)", "read (mm)")
    table.columns[0].overflow = "fold"  # long names go on in the next line
    table.columns[0].no_wrap = False
    for name, each in result.objects.items():
        values = each.to_dict()
        table.add_row(
            name,
            f"{each.normal_error:.1f}",
            f"{values['normal_error_of_reading_nothing']:.1f}",
            _or_none(each.ring_normal_error, ".1f"),
            f"{each.depth_error:.3f}",
            _or_none(each.ring_depth_error, ".3f"),
            f"{values['deepest']:.2f}",
            f"{values['deepest_read']:.2f}",
        )
    means = (
        f"{result.normal_error:.1f}",
        "",
        _or_none(result.ring_normal_error, ".1f"),
        f"{result.depth_error:.3f}",
        _or_none(result.ring_depth_error, ".3f"),
    )
    table.add_row("mean", *means, "", "", style="bold")
    output.print(table)


def _or_none(value: float, digits: str) -> str:
    """Return a number as text; a dash for NaN."""
    return "-" if math.isnan(value) else f"{value:{digits}}"
