"""Options that several commands share, and their parsers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from optisense.errors import OptiSenseError
    from optisense.geometry import Contact
    from optisense.registry import Registry

DesignArgument = Annotated[
    str,
    typer.Argument(
        metavar="DESIGN",
        help="A built-in sensor's name (gelsight-mini, ...) or the folder of a design.",
    ),
]

ContactOption = Annotated[
    list[str] | None,
    typer.Option(
        "--contact",
        "-c",
        metavar="KIND:SIZE@U,V:DEPTH",
        help="A contact: an indenter, its place on the skin and its depth, for example "
        "sphere:1.5@0,0:0.8 (a ball of 1.5 mm radius, in the middle, 0.8 mm deep). May be given "
        "several times.",
    ),
]


def parse_variant(text: str) -> str:
    """Parse ``auto``, ``llvm`` or ``cuda``.

    Raises:
        typer.BadParameter: the text is another one.
    """
    if text not in ("auto", "llvm", "cuda"):
        raise typer.BadParameter(f"'{text}' is none of auto, llvm, cuda", param_hint="--variant")
    return text


VariantOption = Annotated[
    str,
    typer.Option(
        metavar="auto|llvm|cuda",
        help="Where to render: on the processor (llvm), on an NVIDIA GPU (cuda), or on a "
        "GPU if there is one (auto).",
        callback=parse_variant,
    ),
]

WorkersOption = Annotated[
    int, typer.Option(min=1, max=1024, metavar="N", help="Number of processes on this machine.")
]


def out_option(text: str, metavar: str = "DIR") -> Any:
    """Return the option ``--out``, with this help text."""
    return typer.Option("--out", "-o", metavar=metavar, help=text)


def json_option(text: str) -> Any:
    """Return the option ``--json``, with this help text."""
    return typer.Option("--json", help=text)


def parse_contacts(texts: list[str] | None) -> list[Contact]:
    """Parse the values of ``--contact``.

    Raises:
        ContactError: a value can't be read.
    """
    from optisense.geometry import parse_contact

    return [parse_contact(text) for text in texts or []]


def print_small_indenters(contacts: Sequence[Contact]) -> int:
    """Print a warning for each indenter that is too small to be in millimetres, and return their
    number.
    """
    from optisense.cli.console import output
    from optisense.geometry.contact import size_warning

    warnings = list(filter(None, map(size_warning, contacts)))
    for warning in warnings:
        output.print(f"warning: {warning}", style="yellow")
    return len(warnings)


def print_summaries(registry: Registry[Any]) -> None:
    """Print name and summary of all objects of a registry, and why others can't be loaded."""
    from optisense.cli.console import messages, output

    failures: dict[str, OptiSenseError] = {}
    for name, thing in registry.loadable(failures):
        output.print(f"{name:<14} {thing.summary}")
    for name, error in failures.items():
        messages.print(f"{name:<14} unavailable: {error}", style="yellow")
