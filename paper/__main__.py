"""``python -m paper``: the paper's tables and figures, made again."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from optisense.cli import stopping
from optisense.cli.console import EXIT_INTERRUPTED, handles_errors, messages, output
from optisense.cli.leaving import run_and_leave
from optisense.cli.progress import progress_line
from optisense.time_left import TimedStep, TimeLeft

if TYPE_CHECKING:
    from paper import Experiment
    from paper.bench import Tell

app = typer.Typer(
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
    context_settings={"help_option_names": ["-h", "--help"]},
)


@app.command()
@handles_errors
def experiment(
    name: Annotated[
        str | None,
        typer.Argument(
            metavar="[NAME|all]",
            help="Which; lists them when left out.",
            show_default=False,
        ),
    ] = None,
    quick: Annotated[
        bool, typer.Option("--quick", help="Less of everything: minutes, and less sure.")
    ] = False,
    out: Annotated[
        Path,
        typer.Option(
            "--out", "-o", metavar="DIR", help="Folder of results; what is in it is not done again."
        ),
    ] = Path("paper-results"),
    seeds: Annotated[
        int | None,
        typer.Option(
            min=1,
            metavar="N",
            help="Repeat what has chance in it with so many seeds.",
            show_default="3, or 2 with --quick",
        ),
    ] = None,
    workers: Annotated[
        int | None,
        typer.Option(
            min=1, metavar="N", help="Processes on this machine.", show_default="one a processor"
        ),
    ] = None,
    page: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Also collect the results on one page (Markdown), with files beside it.",
            show_default=False,
        ),
    ] = None,
) -> None:
    """Make tables and figures of the OptiSense paper again, and say what agrees.

    Stopped or killed at any moment, the same command continues: every single evaluation is kept.
    """
    if name is None:
        _print_list()
        return

    from optisense.cli.output_folder import ensure_writable, take_folder
    from optisense.search.executors import processors
    from paper import find, prepare, run, write_page
    from paper.bench import Bench

    chosen = find(name)
    for each in chosen:
        each.settings(quick, seeds)
    take_folder(out)
    if page is not None:
        ensure_writable(page.parent)
    count = min(processors(), MOST_WORKERS) if workers is None else workers
    try:
        if len(chosen) > 1:
            with _shown_units(name, count) as show:
                prepare(chosen, Bench(out, count, show), quick, seeds)
        for each in chosen:
            with _shown_units(each.name, count) as show:
                result = run(each, Bench(out, count, show), quick, seeds)
            _print_result(each, result, out)
    except KeyboardInterrupt:
        messages.print(
            f"interrupted: what is finished is kept in {out}; the same command continues"
        )
        raise typer.Exit(EXIT_INTERRUPTED) from None
    if page is not None:
        write_page(page, out, chosen)
        output.print(f"page: {page}", markup=False)


MOST_WORKERS = 8
"""Largest number of workers unless the user says otherwise, as each takes two gigabytes."""


@contextmanager
def _shown_units(name: str, workers: int) -> Iterator[Tell]:
    """The units of an experiment's step on a progress line.

    An experiment may ask more when a step has been answered, so the time left is the step's.
    """
    with progress_line() as line:
        line.say(f"{name}: loading")
        time_left: TimeLeft | None = None
        begun = 0, 0

        def show(done: int, count: int, label: str) -> None:
            nonlocal time_left, begun
            if time_left is None or count != begun[1] or done < begun[0]:
                time_left = TimeLeft([TimedStep("units", count, warm_up=min(workers, count - 1))])
                time_left.begin("units", done=done)
                begun = done, count
            time_left.advance(done)
            line.show(name, done, count, time_left.seconds_left, [label] if label else [])

        yield show


def _print_list() -> None:
    from rich.table import Table

    from paper import EXPERIMENTS

    table = Table(box=None, pad_edge=False, show_header=False)
    for each in EXPERIMENTS.values():
        table.add_row(each.name, each.about)
    table.add_row("all", "all of them")
    output.print(table)


def _print_result(experiment: Experiment, result: dict[str, Any], out: Path) -> None:
    """The verdicts, one a line."""
    output.print(f"[bold]{experiment.title}[/bold]")
    for claim in result["claims"]:
        output.print(f"  {claim['verdict']:<15} {claim['says']}", markup=False)
        output.print(f"                  {claim['here']}", markup=False)
    if result["gaps"]:
        output.print(f"  {len(result['gaps'])} without a score; see the text", markup=False)
    minutes = result["seconds"]["processor"] / 60.0
    summary = f"  {result['units']} evaluations, {minutes:.1f} processor minutes"
    output.print(f"{summary}; results: {out / experiment.name}", markup=False)


def main() -> None:
    """Run the command with the process's arguments and exit."""
    stopping.install_handlers()
    run_and_leave(app)


if __name__ == "__main__":
    main()
