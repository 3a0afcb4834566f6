"""What `optisense task` prints of its results."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from optisense.cli.console import output

if TYPE_CHECKING:
    from optisense.tasks import PerceptionResult, ReconstructionResult


def print_perception(results: Iterable[PerceptionResult]) -> None:
    """A row for each task."""
    from rich.table import Table

    table = Table(box=None, pad_edge=False)
    table.add_column("task")
    for heading in ("mean error", "among folds", "of guessing", "signal to noise", "samples"):
        table.add_column(heading, justify="right")
    for result in results:
        reading = result.reading
        table.add_row(
            result.task,
            f"{reading.error:.3g} {result.unit}",
            f"± {reading.spread:.2g}",
            f"{reading.guess:.3g} {result.unit}",
            f"{result.snr:.3g}",
            f"{len(result.samples.targets)}",
        )
    output.print(table)


def print_reconstruction(result: ReconstructionResult) -> None:
    """A row for each object, and their mean."""
    from rich.table import Table

    table = Table(box=None, pad_edge=False)
    table.add_column("object")
    for heading in ("normals off by", "of reading nothing", "depth off by", "deepest", "read"):
        table.add_column(heading, justify="right")
    for name, each in result.objects.items():
        values = each.to_dict()
        table.add_row(
            name,
            f"{values['normal_error']:.1f} degrees",
            f"{values['normal_error_of_reading_nothing']:.1f} degrees",
            f"{values['depth_error']:.3f} mm",
            f"{values['deepest']:.2f} mm",
            f"{values['deepest_read']:.2f} mm",
        )
    means = f"{result.normal_error:.1f} degrees", "", f"{result.depth_error:.3f} mm"
    table.add_row("mean", *means, "", "", style="bold")
    output.print(table)
