"""``optisense report``: a study as a page to look at, keep and send."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from optisense.cli.console import ends_well, output
from optisense.cli.progress import ProgressLine, progress_line
from optisense.commands.rendering import BeforeAndAfterOptions
from optisense.time_left import TimedStep

if TYPE_CHECKING:
    from optisense.report.before_after import Look
    from optisense.search import Study

REPORT_FILE = "report.html"


@ends_well
def report(
    study: Annotated[
        Path,
        typer.Argument(
            metavar="STUDY", help="The folder of a search (its --out).", show_default=False
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            "-o",
            metavar="FILE",
            help="The page to write.",
            show_default="STUDY/report.html",
        ),
    ] = None,
    *,
    options: BeforeAndAfterOptions,
    pictures: Annotated[
        bool, typer.Option(help="Render the sensor as it was and as it is best.")
    ] = True,
) -> None:
    """Write a study as one HTML page: how the search went, what it found, and the trials.

    A search may still be running: the page shows the trials so far.
    """
    from optisense.cli.output_folder import ensure_writable
    from optisense.report.study import write_study_report
    from optisense.search import Study

    page = study / REPORT_FILE if out is None else out
    opened = Study.open(study)
    try:
        if page.is_dir():
            raise typer.BadParameter(f"'{page}' is a folder", param_hint="--out")
        ensure_writable(page.parent)
        with progress_line(*_steps(options.photons, pictures)) as line:
            looks = _looks(opened, options.photons, pictures, line)
            line.begin(WRITING)
            write_study_report(page, opened, looks)
    finally:
        opened.close()
    output.print(f"report: {page}", markup=False)


WRITING = "writing the page"


def _steps(photons: int, pictures: bool) -> list[TimedStep]:
    """The steps, with their usual times (seconds on two cores of a desktop processor, GelSight
    Mini)."""
    look = 5.0 + 2.2 * photons / 1e6 if pictures else 1.0
    return [
        TimedStep("the sensor before the search", 1, 3.0 + look),
        TimedStep("the sensor after the search", 1, look),
        TimedStep(WRITING, 1, 3.0),
    ]


def _looks(study: Study, photons: int, pictures: bool, line: ProgressLine) -> dict[str, Look]:
    """Chief rays of the start and of the best trial, and pictures where they are asked for.

    Raises:
        SetupError: the renderer can't run on this machine, and pictures are asked for.
    """
    from optisense.errors import SetupError
    from optisense.report.before_after import look

    designs = {"before": study.space.design}
    best = study.best
    if best is not None:
        designs["after"] = best.design
    found = {}
    verb = "rendering" if pictures else "tracing the rays of"
    for label, design in designs.items():
        step = f"the sensor {label} the search"
        line.begin(step, text=f"{verb} {step}")
        try:
            settings = study.settings.settings
            found[label] = look(design, settings, pictures=pictures, photons=photons)
        except SetupError:
            if pictures:
                raise
            return {}
    return found
