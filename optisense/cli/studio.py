"""``optisense studio``: install and start the sensor bench in Blender."""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Annotated

import typer

from optisense.cli.console import handles_errors, messages, output
from optisense.cli.studio_extension import (
    find_blender,
    install,
    source_folder,
    version_of,
    write_zip,
)
from optisense.errors import SetupError

ENGINE = "OPTISENSE_ENGINE"
OPEN = "OPTISENSE_OPEN"


@handles_errors
def studio(
    design: Annotated[
        str | None,
        typer.Argument(
            metavar="[DESIGN]",
            help="A built-in sensor's name or the folder of a design, which Blender opens.",
        ),
    ] = None,
    blender: Annotated[
        Path | None,
        typer.Option(
            metavar="PATH",
            help="Blender's executable; if left out, it is looked for on the search path and "
            "in the usual places.",
        ),
    ] = None,
    archive: Annotated[
        Path | None,
        typer.Option(
            "--zip",
            metavar="FILE.zip",
            help="Only write the extension to a file, to install it by hand.",
        ),
    ] = None,
    start: Annotated[bool, typer.Option(help="Start Blender after installing.")] = True,
) -> None:
    """Install the extension in Blender, and start Blender."""
    if archive is not None:
        if archive.suffix.lower() != ".zip":
            raise typer.BadParameter(f"'{archive}' must end in .zip", param_hint="--zip")
        write_zip(archive)
        output.print(str(archive))
        return
    wanted = None if design is None else _to_open(design)
    program, version = find_blender(blender)
    messages.print(f"Blender {version}: {program}")
    with tempfile.TemporaryDirectory(prefix="optisense-") as folder:
        built = Path(folder) / f"optisense_studio-{version_of(source_folder())}.zip"
        write_zip(built)
        install(program, built, _environment(None))
    messages.print("The extension is installed: press N in a 3D view, tab OptiSense.")
    if start:
        raise typer.Exit(_start(program, wanted))


def engine_command() -> str:
    """Return the shell command by which the extension starts this installation's engine."""
    return shlex.join([sys.executable, "-m", "optisense.cli", "engine"])


def _to_open(design: str) -> str:
    """Return the design as the extension takes it: a built-in's name, or an absolute path."""
    from optisense import sensors

    sensors.load(design)  # reports errors before Blender starts
    return os.path.realpath(design) if Path(design).exists() else design


def _start(blender: Path, design: str | None) -> int:
    """Run Blender until it is closed, and return its exit code."""
    try:
        return subprocess.run([str(blender)], env=_environment(design), check=False).returncode
    except OSError as error:
        raise SetupError(f"Blender does not start: {error}", where=str(blender)) from error


def _environment(design: str | None) -> dict[str, str]:
    """Return Blender's environment, with the engine's command and the design to open."""
    environment = {**os.environ, ENGINE: engine_command()}
    environment.pop(OPEN, None)
    if design is not None:
        environment[OPEN] = design
    return environment
