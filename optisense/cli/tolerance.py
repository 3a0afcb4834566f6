"""``optisense tolerance``: compute the effect of manufacturing errors on a design's score."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from optisense.cli import stopping
from optisense.cli.console import (
    EXIT_INTERRUPTED,
    handles_errors,
    messages,
    output,
    print_json,
    table_of,
)
from optisense.cli.options import (
    DesignArgument,
    VariantOption,
    WorkersOption,
    json_option,
    out_option,
)
from optisense.cli.output_folder import take_folder
from optisense.cli.progress import ProgressLine, about, progress_line
from optisense.commands.scoring import ToleranceOptions
from optisense.text import cell
from optisense.writing import csv_table, remove_own_page, write_json, write_text

if TYPE_CHECKING:
    from optisense.search.tolerance.analysis import ScoreDistribution, Tolerance
    from optisense.search.tolerance.sensitivity import Estimate

JSON_FILE = "tolerance.json"
VALUES_FILE = "tolerance.csv"
REPORT_FILE = "tolerance.html"


@handles_errors
def tolerance(
    design: DesignArgument,
    *,
    options: ToleranceOptions,
    workers: WorkersOption = 1,
    out: Annotated[Path | None, out_option("Folder for tolerance.json and .csv.")] = None,
    report: Annotated[
        bool,
        typer.Option("--report", help="Also write tolerance.html, with figures, into the folder."),
    ] = False,
    as_json: Annotated[bool, json_option("Print JSON with every score instead of tables.")] = False,
    variant: VariantOption = "auto",
) -> None:
    """Compute how much manufacturing errors change a design's scores.

    P10 is the score that nine of ten manufactured sensors reach. The share of each error in the
    variance says which error matters most.
    """
    if report and out is None:
        raise typer.BadParameter("needs a folder: --out DIR", param_hint="--report")
    settings = options.for_objectives()

    last: list[int] = []
    waits = (lambda line: _waits(line, last)) if workers == 1 else None
    with progress_line(waits) as line:
        line.begin("loading")
        from optisense.sensors import load

        sensor = load(design)
        from optisense.search.space.text import parse_errors
        from optisense.search.tolerance.analysis import tolerance as find_tolerance

        errors = parse_errors(options.errors) if options.errors else None
        if out is not None:
            take_folder(out)

        def show(done: int, count: int, doing: str) -> None:
            last[:] = [done]
            line.follow(*stage_text(done, count), [doing] if doing else [])

        found = find_tolerance(
            sensor,
            options.objectives,
            errors,
            sensors=options.sensors,
            seed=options.seed,
            workers=workers,
            settings=settings,
            variant=variant,
            progress=show,
            on_wait=stopping.print_wait,
        )
    if out is not None:
        _write(found, out, report)
    if as_json:
        print_json(found.to_dict())
    else:
        print_tolerance(found, usual=errors is None)
        if out is not None:
            for name in [JSON_FILE, VALUES_FILE, *([REPORT_FILE] if report else [])]:
                output.print(f"written: {out / name}")
    if found.interrupted:
        kept = "" if out is not None else "; use --out DIR to keep it"
        messages.print(
            f"interrupted: the result is from the {found.sensors} sensors scored so far{kept}"
        )
        raise typer.Exit(EXIT_INTERRUPTED)


def stage_text(done: int, count: int) -> tuple[str, int, int]:
    """Return the text of what is being scored, the number of finished scores and that of all.

    The scores of the nominal design come first, and are not counted as sensors.
    """
    from optisense.search.tolerance.analysis import OWN_SCORES

    if done < OWN_SCORES:
        return "scoring the nominal design", done, OWN_SCORES
    return "scoring sensors", done - OWN_SCORES, count - OWN_SCORES


def _waits(line: ProgressLine, last: list[int]) -> str:
    """Return what a first Ctrl-C waits for: the current score."""
    return (
        f"finishing score {last[0] + 1}{about(line.pace)}" if last else "finishing the first score"
    )


def _write(found: Tolerance, folder: Path, report: bool) -> None:
    from optisense.report.tolerance import render_tolerance

    write_json(folder / JSON_FILE, found.to_dict())
    rows = found.values.reshape(-1, len(found.names)).tolist()
    write_text(folder / VALUES_FILE, csv_table([cell(name) for name in found.names], rows))
    if report:
        write_text(folder / REPORT_FILE, render_tolerance(found))
    else:  # a page of earlier figures would contradict these
        remove_own_page(folder / REPORT_FILE, "tolerance")


def print_tolerance(found: Tolerance, usual: bool) -> None:
    """Print one table of percentiles, and one of shares for each objective; `usual` if the errors
    are the usual ones.
    """
    table = table_of("objective", "nominal", "P10", "P50", "P90", "spread", "noise")
    for name, each in found.results.items():
        table.add_row(
            name,
            _number(each.nominal),
            *(_number(value.value) if found.sensors else "" for value in each.percentiles.values()),
            f"± {each.deviation:.2g}" if math.isfinite(each.deviation) else "",
            f"± {each.noise:.2g}" if each.noise > 0.0 else "",
        )
    output.print(table)
    output.print(f"{found.sensors} sensors were scored")
    for name, each in found.results.items():
        if each.deviation != 0.0:
            _print_shares(name, each)
        if each.caveat:
            output.print(f"{name}: {each.caveat}")
    for reason, count in sorted(found.failures.items(), key=lambda item: -item[1]):
        output.print(f"{count} of {found.sensors} sensors fail: {reason}")
    if usual:
        output.print(
            "the camera and the positions of parts were taken as exact. --error replaces the usual "
            "errors: give all that matter, such as --error camera.position.z=0.1 "
            "--error lights.position=0.1"
        )


def _print_shares(name: str, found: ScoreDistribution) -> None:
    shares = ("share of the variance", "standard error", "90 % interval")
    table = table_of(f"which error matters for {name}", *shares)
    for source, share in found.shares.items():
        table.add_row(source, *_share(share))
    output.print(table)


def _share(share: Estimate | None) -> tuple[str, str, str]:
    if share is None:
        return "unknown", "", ""
    return f"{share.value:.2f}", f"{share.error:.2f}", f"{share.low:.2f} to {share.high:.2f}"


def _number(value: float) -> str:
    return f"{value:.4g}" if math.isfinite(value) else "fails"
