"""The command ``optisense`` and its sub-commands."""

from __future__ import annotations

from typing import Annotated

import typer

from optisense import __version__
from optisense.cli import console
from optisense.cli.apply import apply
from optisense.cli.cage import cage_app
from optisense.cli.check import check
from optisense.cli.dataset import dataset
from optisense.cli.doctor import doctor
from optisense.cli.engine import engine
from optisense.cli.evaluate import evaluate
from optisense.cli.experiment import experiment
from optisense.cli.export import export
from optisense.cli.leaving import run_and_leave
from optisense.cli.library import library_app
from optisense.cli.new import new
from optisense.cli.render import render
from optisense.cli.report import report
from optisense.cli.search import search
from optisense.cli.studio import studio
from optisense.cli.task import task_app
from optisense.cli.tolerance import tolerance

app = typer.Typer(
    name="optisense",
    help="Simulate and design camera-based tactile sensors of the GelSight family.",
    epilog="Lengths are in mm, angles in degrees, powers in mW.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
    context_settings={"help_option_names": ["-h", "--help"]},
)
app.command()(new)
app.command()(check)
app.command()(render)
app.command()(dataset)
app.command()(evaluate)
app.command()(search)
app.command()(apply)
app.command()(report)
app.command()(tolerance)
app.command()(experiment)
app.command()(export)
app.command()(studio)
app.command()(engine)
app.command()(doctor)
app.add_typer(cage_app, name="cage")
app.add_typer(library_app, name="library")
app.add_typer(task_app, name="task")


def _print_version(wanted: bool) -> None:
    if wanted:
        print(f"optisense {__version__}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool,
        typer.Option(
            "--version", callback=_print_version, is_eager=True, help="Show the version and exit."
        ),
    ] = False,
    debug: Annotated[
        bool, typer.Option("--debug", help="Show the traceback of an unexpected error.")
    ] = False,
) -> None:
    console.set_debug(debug)


def main() -> None:
    """Run the command line with the process's arguments and exit."""
    run_and_leave(app)
