"""``optisense calibrate``: fit a design to photographs of the real sensor."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from optisense.cli.compare import PhotosArgument, reading_lines
from optisense.cli.console import (
    EXIT_INTERRUPTED,
    handles_errors,
    messages,
    output,
    print_notes,
    table_of,
)
from optisense.cli.options import DesignArgument, VariantOption, out_option
from optisense.cli.progress import progress_line
from optisense.commands.comparing import CalibrateOptions

if TYPE_CHECKING:
    from optisense.calibration.realism import Realism
    from optisense.calibration.result import Calibration

COLUMNS = "unexplained", "contact", "ring", "similarity"
"""Figures of presses whose medians are printed."""


@handles_errors
def calibrate(
    design: DesignArgument,
    photos: PhotosArgument,
    out: Annotated[Path, out_option("Folder for the fitted design.")],
    *,
    options: CalibrateOptions,
    variant: VariantOption = "auto",
) -> None:
    """Fit a design to photographs of the real sensor.

    Writes the fitted design, calibration.json and calibration.html into the folder. Some presses
    are held out of the fit and test the result. If the command was interrupted, the same command
    continues from the renderings that it kept in the folder.
    """
    with progress_line() as line:
        line.begin("loading")
        from optisense.calibration import read_photographs
        from optisense.report.calibration import PAGE_FILE, calibrate_into
        from optisense.sensors import load

        sensor = load(design)
        photographs = read_photographs(photos, options.ball)
        line.begin("fitting")

        def report(what: str, done: int, count: int) -> None:
            line.advance(done, count)
            line.say(what, done, count)

        try:
            found = calibrate_into(out, sensor, photographs, options.settings(), variant, report)
        except KeyboardInterrupt:
            messages.print("interrupted: the same command continues; finished renderings are kept")
            raise typer.Exit(EXIT_INTERRUPTED) from None
    print_notes([*found.before.notes, *found.notes])
    print_calibration(found)
    output.print(f"design: {out}")
    output.print(f"page:   {out / PAGE_FILE}")


def print_calibration(found: Calibration) -> None:
    """Print the fitted numbers, and the design's distance from the photographs before and after."""
    table = table_of("fitted", "before", "after", "±", "")
    for each in found.numbers:
        table.add_row(
            each.words,
            each.before_words,
            f"{each.after:.4g}",
            f"{each.uncertainty:.2g}",
            each.unit if each.determined else f"{each.unit} (not determined)".strip(),
        )
    output.print(table)
    output.print("± is one standard deviation", style="dim")
    for one, other, value in found.alike:
        output.print(
            f"strongly correlated: {one}, and {other} (correlation {value:.2f})", style="dim"
        )
    held = bool(found.held_out)
    what = "presses held out" if held else "fitted presses"
    table = table_of(what, *COLUMNS, "background (dB)")
    for name, side in (("before", found.before), ("after", found.after)):
        chosen = found.of_presses(side.realism, held_out=held)
        table.add_row(name, *_figures(chosen))
    table.add_row(
        "noise alone",
        *(f"{chosen.median_of_noise(name):.3f}" for name in COLUMNS),
        "",
    )
    output.print(table)
    output.print(found.verdict())
    for line in reading_lines(found.of_presses(found.after.realism, held_out=held)):
        output.print(line)
    output.print(f"exposure of the photographs: {found.exposure:.4g}")


def _figures(found: Realism) -> list[str]:
    return [*(f"{found.median(name):.3f}" for name in COLUMNS), f"{found.background.ratio:.1f}"]
