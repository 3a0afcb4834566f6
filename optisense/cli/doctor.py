"""``optisense doctor``: check that this machine has all that rendering needs."""

from __future__ import annotations

import os
import platform
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Literal

import typer

from optisense import __version__
from optisense.cli.console import EXIT_FAILURE, handles_errors, output
from optisense.errors import OptiSenseError

State = Literal["good", "note", "bad"]
_MARKS: dict[State, str] = {
    "good": "[green]ok[/]     ",
    "note": "[yellow]note[/]   ",
    "bad": "[red]missing[/]",
}


@dataclass(frozen=True)
class Finding:
    """One line of the doctor's report."""

    subject: str
    state: State
    text: str
    hint: str = ""


@handles_errors
def doctor() -> None:
    """Check that this machine has what rendering needs, and say how to install what is missing."""
    ill = False
    for finding in examine():
        ill = ill or finding.state == "bad"
        output.print(f"{_MARKS[finding.state]} {finding.subject:<14}", end=" ", markup=True)
        output.print(finding.text)
        if finding.hint:
            output.print(f"{'':<22} {finding.hint}", style="bold")
    if ill:
        raise typer.Exit(EXIT_FAILURE)
    output.print("Everything needed is here.", style="green")


def examine() -> Iterator[Finding]:
    """Yield the findings one by one, so that slow ones don't hold back the others."""
    checks: tuple[Callable[[], Finding], ...] = (
        _package,
        _python,
        _renderer,
        _llvm,
        _gpu,
        _kernel,
        _library,
        _kernel_cache,
        _temporary_folder,
    )
    for check in checks:
        yield check()


def _package() -> Finding:
    return Finding("optisense", "good", f"{__version__} in {Path(__file__).parent.parent}")


def _python() -> Finding:
    text = f"{platform.python_version()} on {platform.platform()} ({sys.executable})"
    return Finding("python", "good", text)


def _renderer() -> Finding:
    try:
        text = ", ".join(f"{name} {version(name)}" for name in ("mitsuba", "drjit", "numpy"))
    except PackageNotFoundError as error:
        return Finding("renderer", "bad", f"{error.name} is not installed", "pip install optisense")
    return Finding("renderer", "good", text)


def _llvm() -> Finding:
    from optisense.optics.backend.llvm import find_llvm

    try:
        return Finding("libLLVM", "good", str(find_llvm()))
    except OptiSenseError as error:
        return Finding("libLLVM", "bad", error.message, error.hint or "")


def _gpu() -> Finding:
    from optisense.optics.backend.variant import cuda_device_found

    try:
        found = cuda_device_found()
    except OptiSenseError as error:
        return Finding("GPU", "note", error.message)
    if found:
        return Finding("GPU", "good", "a CUDA device; --variant auto uses it")
    return Finding("GPU", "note", "no CUDA device; rendering runs on the processor")


def _kernel() -> Finding:
    from optisense.optics.backend.variant import run_test_kernel

    test = run_test_kernel()
    if test.passed:
        text = f"compiled and ran in {test.seconds:.1f} s ({test.variant}), {test.message}"
        return Finding("test kernel", "good", text)
    return Finding("test kernel", "bad", test.message)


def _library() -> Finding:
    from optisense import library, sensors

    try:
        counts = {
            kind: len(list(library.names(kind)))
            for kind in ("material", "coating", "light", "camera")
        }
    except (OptiSenseError, OSError) as error:
        return Finding("library", "bad", str(error), "Install the package again")
    text = ", ".join(f"{count} {kind}s" for kind, count in counts.items())
    return Finding("library", "good", f"{text}, {len(sensors.SENSORS.names())} sensors")


def _kernel_cache() -> Finding:
    folder = Path.home() / ".drjit"
    if _is_writable(folder if folder.exists() else folder.parent):
        return Finding("kernel cache", "good", f"{folder} can be written")
    return Finding(
        "kernel cache",
        "note",
        f"{folder} can't be written",
        "Kernels will be compiled anew in each process",
    )


def _temporary_folder() -> Finding:
    try:
        folder = Path(tempfile.gettempdir())
    except FileNotFoundError as error:
        return Finding("temporary", "bad", str(error), "Set TMPDIR to a folder you may write to")
    return Finding("temporary", "good", f"{folder} can be written")


def _is_writable(folder: Path) -> bool:
    return folder.is_dir() and os.access(folder, os.W_OK | os.X_OK)
