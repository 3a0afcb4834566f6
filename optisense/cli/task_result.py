"""What `optisense task` prints of its results."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from optisense.cli.console import output, table_of

if TYPE_CHECKING:
    from optisense.tasks import PerceptionResult, ReconstructionResult


def print_perception(results: Iterable[PerceptionResult]) -> None:
    """A row for each task."""
    heads = ("mean error", "among folds", "of guessing", "signal to noise", "samples")
    table = table_of("task", *heads)
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
    heads = ("normals off by", "of reading nothing", "depth off by", "deepest", "read")
    table = table_of("object", *heads)
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
