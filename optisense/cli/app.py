"""The command ``optisense`` and its sub-commands."""

from __future__ import annotations

import gc
from typing import Annotated

import typer

from optisense import __version__
from optisense.cli import console, stopping
from optisense.cli.commands import Commands
from optisense.cli.leaving import run_and_leave

app = typer.Typer(
    cls=Commands,
    name="optisense",
    help="Simulate and design camera-based tactile sensors of the GelSight family.",
    epilog="Lengths are in mm, angles in degrees, powers in mW.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
    context_settings={"help_option_names": ["-h", "--help"]},
)


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


NEW_OBJECTS = 50_000
"""Number of new objects after which Python collects garbage (700 by default). Modules make hundreds
of thousands, nearly all of which stay, and examining them again and again takes a thirtieth of a
render.
"""


def main() -> None:
    """Run the command line with the process's arguments and exit."""
    gc.set_threshold(NEW_OBJECTS)
    stopping.install_handlers()
    run_and_leave(app)
