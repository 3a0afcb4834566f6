"""Results of `optisense task` as text."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING

from optisense.cli.console import output, table_of

if TYPE_CHECKING:
    from optisense.tasks import PerceptionResult, ReconstructionResult


def print_perception(results: Iterable[PerceptionResult]) -> None:
    """Print a row for each task."""
    heads = ("mean error", "of folds", "baseline error", "signal to noise", "samples")
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
    """Print a row for each object, and their mean: degrees of normals, and mm of depths."""
    heads = ("normals (°)", "if flat (°)", "ring (°)", "depth (mm)", "ring (mm)")
    table = table_of("object", *heads, "deepest (mm)", "read (mm)")
    table.columns[0].overflow = "fold"  # long names go on in the next line
    table.columns[0].no_wrap = False
    for name, each in result.objects.items():
        values = each.to_dict()
        table.add_row(
            name,
            f"{each.normal_error:.1f}",
            f"{values['normal_error_of_reading_nothing']:.1f}",
            _or_none(each.ring_normal_error, ".1f"),
            f"{each.depth_error:.3f}",
            _or_none(each.ring_depth_error, ".3f"),
            f"{values['deepest']:.2f}",
            f"{values['deepest_read']:.2f}",
        )
    means = (
        f"{result.normal_error:.1f}",
        "",
        _or_none(result.ring_normal_error, ".1f"),
        f"{result.depth_error:.3f}",
        _or_none(result.ring_depth_error, ".3f"),
    )
    table.add_row("mean", *means, "", "", style="bold")
    output.print(table)


def _or_none(value: float, digits: str) -> str:
    """Return a number as text; a dash for NaN."""
    return "-" if math.isnan(value) else f"{value:{digits}}"
