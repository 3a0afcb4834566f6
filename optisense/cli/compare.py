"""``optisense compare``: compare a design with photographs of the real sensor."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from optisense.cli.console import (
    handles_errors,
    output,
    print_json,
    print_notes,
    table_of,
)
from optisense.cli.options import DesignArgument, VariantOption, json_option, out_option
from optisense.cli.progress import progress_line
from optisense.commands.comparing import CompareOptions

if TYPE_CHECKING:
    from optisense.calibration.comparing import Comparison
    from optisense.calibration.realism import Realism

PhotosArgument = Annotated[
    Path,
    typer.Argument(
        metavar="PHOTOS",
        help="Folder with background.png and presses.csv, of gs_sdk, or of Taxim (dataPack.npz).",
    ),
]


@handles_errors
def compare(
    design: DesignArgument,
    photos: PhotosArgument,
    out: Annotated[
        Path | None,
        out_option("The page to write.", "FILE"),
    ] = None,
    *,
    options: CompareOptions,
    as_json: Annotated[bool, json_option("Print all figures as JSON.")] = False,
    variant: VariantOption = "auto",
) -> None:
    """Measure how much a design differs from photographs of the real sensor.

    The balls of the photographs are pressed into the model, at the same places and with contacts of
    the same size. The pictures are compared in the contact, in the ring around it, far from it, and
    without contact.
    """
    if out is not None and out.is_dir():
        raise typer.BadParameter(f"'{out}' is a folder", param_hint="--out")
    with progress_line() as line:
        line.begin("loading")
        from optisense.calibration import read_photographs
        from optisense.calibration.comparing import compare as compare_with
        from optisense.cli.output_folder import ensure_writable
        from optisense.optics import OpticalModel
        from optisense.report.comparison import write_comparison
        from optisense.sensors import load

        sensor = load(design)
        photographs = read_photographs(photos, options.ball)
        if out is not None:
            ensure_writable(out.parent)
        model = OpticalModel(sensor, variant)
        count = 1 + len(photographs.presses)
        line.begin("rendering the presses", count)
        found = compare_with(
            model,
            photographs,
            photons=options.photons,
            seed=options.seed,
            refine=not options.as_labelled,
            progress=lambda done: line.advance(done, count),
        )
        if out is not None:
            line.begin("writing the page")
            write_comparison(out, sensor, found)
    print_notes(found.notes)
    if as_json:
        print_json({"notes": list(found.notes), **found.realism.as_data()})
        return
    print_comparison(found)
    if out is not None:
        output.print(f"page: {out}")


def reading_lines(found: Realism) -> list[str]:
    """Return sentences on readers that were calibrated on pictures of the model or of the real
    sensor, and read the other's.
    """
    if not found.readings:
        return []
    from optisense.calibration.realism import sees_no_curvature

    lines = []
    for one, other, of_radius, of_degrees in (
        ("the model", "the photographs", "radius", "degrees"),
        ("the photographs", "the model", "radius_back", "degrees_back"),
        ("the photographs", "other photographs", "radius_alone", "degrees_alone"),
    ):
        radius, degrees = found.median_reading(of_radius), found.median_reading(of_degrees)
        if math.isnan(radius):
            continue
        reads = f"reads the balls of {other} {radius:.2f} times as large as they are, and"
        if sees_no_curvature(radius):
            reads = f"sees no curvature in the balls of {other}, and reads"
        lines.append(
            f"a reader calibrated on {one} {reads} normals with an error of {degrees:.1f} degrees"
        )
    return lines


def print_comparison(found: Comparison) -> None:
    """Print a table of the presses, and one of the background."""
    table = table_of("press", "unexplained", "contact", "ring", "similarity", "far field")
    for press in found.realism.presses:
        shown = (press.unexplained, press.contact, press.ring, press.similarity)
        table.add_row(press.name, *(f"{v:.2f}" for v in shown), f"{press.far_smooth:.1f}")
    figures = ("unexplained", "contact", "ring", "similarity")
    noise = (f"{found.realism.median_of_noise(name):.2f}" for name in figures)
    table.add_row("noise alone", *noise, "")
    output.print(table)
    ground = found.realism.background
    table = table_of("background", "R", "G", "B")
    table.add_row("correlation", *(f"{value:.2f}" for value in ground.correlation))
    table.add_row("mean level, real", *(f"{value:.0f}" for value in ground.real))
    table.add_row("mean level, model", *(f"{value:.0f}" for value in ground.model))
    output.print(table)
    output.print(
        f"signal-to-noise ratio of the background: {ground.ratio:.1f} dB; exposure "
        f"{found.realism.exposure:.4g}",
        style="dim",
    )
    for line in reading_lines(found.realism):
        output.print(line)
