"""``optisense report``: write a study as an HTML page."""

from __future__ import annotations

from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from optisense.cli.console import handles_errors, output
from optisense.cli.progress import ProgressLine, progress_line
from optisense.commands.rendering import BeforeAndAfterOptions

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from optisense.report.before_after import DesignView
    from optisense.search import Study

REPORT_FILE = "report.html"

FEW_PICTURES, MOST_PICTURES = 6, 100
"""Default and largest number of trials that are rendered for the page; each takes some 2 s, and
with the largest number the page has about 10 MB.
"""


@handles_errors
def report(
    study: Annotated[
        Path,
        typer.Argument(metavar="STUDY", help="The folder of a search (its --out)."),
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
        bool,
        typer.Option(
            help="Render pictures of the sensor before and after the search, and of some trials."
        ),
    ] = True,
    trial_pictures: Annotated[
        int,
        typer.Option(
            metavar="N",
            min=0,
            max=MOST_PICTURES,
            help="Number of trials whose pictures the page shows on a click.",
        ),
    ] = FEW_PICTURES,
    watch: Annotated[
        bool,
        typer.Option(
            "--watch", help="Serve the page on this machine, and update it while the search runs."
        ),
    ] = False,
    port: Annotated[
        int,
        typer.Option(
            metavar="N",
            min=0,
            max=65535,
            help="With --watch: the port to serve at; 0 takes a free one.",
        ),
    ] = 0,
) -> None:
    """Write an HTML page about a search: its convergence, its result, and its trials.

    A search may still be running: the page shows the trials so far.
    """
    if watch:
        from optisense.cli.report_watch import watch as watch_study

        if out is not None:
            raise typer.BadParameter("--watch writes no file", param_hint="--out")
        watch_study(study, port, pictures)
        return
    from optisense.cli.output_folder import ensure_writable
    from optisense.report.study import write_study_report
    from optisense.search import Study

    page = study / REPORT_FILE if out is None else out
    with closing(Study.open(study)) as opened:
        if page.is_dir():
            raise typer.BadParameter(f"'{page}' is a folder", param_hint="--out")
        ensure_writable(page.parent)
        count = trial_pictures if pictures else 0
        with progress_line() as line:
            views = _design_views(opened, options.photons, pictures, line)
            shown = _pictures(opened, count, line)
            line.begin("writing the page")
            write_study_report(page, opened, views, pictures=shown, named=str(study))
    output.print(f"report: {page}")


def _pictures(study: Study, count: int, line: ProgressLine) -> dict[int, NDArray[np.uint8]]:
    """Render the trials that a reader is most likely to look at, by number."""
    from optisense.report.trial_pictures import TrialPictures, select_for_pictures

    made, found = TrialPictures(study), {}
    chosen = select_for_pictures(study, study.trials, count)
    if chosen:
        line.begin("rendering trials", len(chosen))
    for done, trial in enumerate(chosen):
        line.say(f"rendering trial {trial.number}", done, len(chosen))
        picture = made.of(trial)
        line.advance(done + 1, len(chosen))
        if picture is not None:
            found[trial.number] = picture
    return found


def _design_views(
    study: Study, photons: int, pictures: bool, line: ProgressLine
) -> dict[str, DesignView]:
    """Return chief rays of the start and of the best trial, with pictures if they are asked for."""
    from optisense.errors import SetupError
    from optisense.report.before_after import design_view

    designs = {"before": study.space.design}
    best = study.best
    if best is not None:
        designs["after"] = best.design
    found = {}
    verb = "rendering" if pictures else "tracing the rays of"
    for label, design in designs.items():
        line.begin(f"{verb} the sensor {label} the search")
        try:
            settings = study.settings.settings
            found[label] = design_view(design, settings, pictures=pictures, photons=photons)
        except SetupError:
            if pictures:
                raise
            return {}
    return found
