"""Command ``python -m paper``, which reproduces the tables and figures of the OptiSense paper."""

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

if TYPE_CHECKING:
    from paper import Experiment
    from paper.bench import ShowUnits

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
            help="Name of the experiment, or all; without it, the experiments are listed.",
            show_default=False,
        ),
    ] = None,
    quick: Annotated[
        bool,
        typer.Option(
            "--quick",
            help="Compute fewer and smaller cases, in minutes; the verdicts are less certain.",
        ),
    ] = False,
    out: Annotated[
        Path,
        typer.Option(
            "--out",
            "-o",
            metavar="DIR",
            help="Folder of results; results that it holds are not computed again.",
        ),
    ] = Path("paper-results"),
    seeds: Annotated[
        int | None,
        typer.Option(
            min=1,
            metavar="N",
            help="Number of seeds of the random numbers of pictures and searches.",
            show_default="3, or 2 with --quick",
        ),
    ] = None,
    workers: Annotated[
        int | None,
        typer.Option(
            min=1,
            metavar="N",
            help="Processes on this machine.",
            show_default="one for each processor",
        ),
    ] = None,
    page: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Also write the results to one page (Markdown), with its pictures beside it.",
            show_default=False,
        ),
    ] = None,
) -> None:
    """Reproduce tables and figures of the OptiSense paper, and report which statements agree.

    The command may be stopped at any moment: every evaluation is kept, and the same command
    continues.
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
            with _shown_units(name) as show:
                prepare(chosen, Bench(out, count, show), quick, seeds)
        for each in chosen:
            with _shown_units(each.name) as show:
                result = run(each, Bench(out, count, show), quick, seeds)
            _print_result(each, result, out)
    except KeyboardInterrupt:
        messages.print(
            f"interrupted: finished results are kept in {out}; the same command continues"
        )
        raise typer.Exit(EXIT_INTERRUPTED) from None
    if page is not None:
        write_page(page, out, chosen)
        output.print(f"page: {page}")


MOST_WORKERS = 8
"""Default of the largest number of worker processes, since each takes about 2 GB of memory."""


@contextmanager
def _shown_units(name: str) -> Iterator[ShowUnits]:
    """Yield a callback that shows the units of an experiment's step on a progress line.

    The time left is that of the step, since an experiment may have more units after it.
    """
    with progress_line() as line:
        line.begin(f"{name}: loading")
        begun = 0, 0

        def show(done: int, count: int, label: str) -> None:
            nonlocal begun
            if count != begun[1] or done < begun[0]:
                line.begin(name, count, done)
                begun = done, count
            line.advance(done, count, *([label] if label else []))

        yield show


def _print_list() -> None:
    """Print the names of the experiments and what each one is about."""
    from rich.table import Table

    from paper import EXPERIMENTS

    table = Table(box=None, pad_edge=False, show_header=False)
    for each in EXPERIMENTS.values():
        table.add_row(each.name, each.about)
    table.add_row("all", "all of them")
    output.print(table)


def _print_result(experiment: Experiment, result: dict[str, Any], out: Path) -> None:
    """Print the verdicts, one on each line, and the cost of the experiment."""
    output.print(f"[bold]{experiment.title}[/bold]")
    for claim in result["claims"]:
        output.print(f"  {claim['verdict']:<15} {claim['says']}")
        output.print(f"                  {claim['here']}")
    if result["gaps"]:
        output.print(f"  {len(result['gaps'])} cases without a score; see the text")
    minutes = result["seconds"]["processor"] / 60.0
    summary = f"  {result['units']} evaluations, {minutes:.1f} processor minutes"
    output.print(f"{summary}; results: {out / experiment.name}")


def main() -> None:
    """Run the command with the process's arguments and exit."""
    stopping.install_handlers()
    run_and_leave(app)


if __name__ == "__main__":
    main()
