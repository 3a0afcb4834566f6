"""Results of `optisense verify` as text."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from optisense.cli.console import output, print_notes, table_of

if TYPE_CHECKING:
    from optisense.search.study.conditions import ConditionResult
    from optisense.tasks import Verification


def print_verification(found: Verification) -> None:
    """Print the errors of each sensor, and the verdict."""
    first, second = found.names
    table = table_of("", first, second, "change", "95 % interval")
    for label, change, digits, unit in (
        ("error of normals", found.normal_change, 1, "degrees"),
        ("error of depth", found.depth_change, 3, "mm"),
    ):
        table.add_row(
            label,
            f"{change.before:.{digits}f} {unit}",
            f"{change.after:.{digits}f} {unit}",
            f"{change.change:+.{digits}f}",
            change.interval(digits),
        )
    one, other = found.views
    table.add_row("skin in view", f"{100 * one.coverage:.0f} %", f"{100 * other.coverage:.0f} %")
    table.add_row("a pixel shows", f"{one.detail:.3f} mm", f"{other.detail:.3f} mm")
    table.add_row("stretched", f"{one.stretching:.2f}", f"{other.stretching:.2f}")
    output.print(table)
    count, places = len(found.settings.objects), found.settings.places
    objects = "1 object" if count == 1 else f"{count} objects, each"
    each = "one place" if places == 1 else f"{places} places"
    output.print(
        f"{objects} at {each}; the errors of a flat reading are "
        f"{found.flat[0]:.1f} degrees and {found.flat[1]:.3f} mm",
        style="dim",
    )
    print_notes(found.notes())
    output.print(f"{found.in_words()}.")


def print_conditions(conditions: Sequence[ConditionResult]) -> None:
    """Print whether the trial of a study meets the conditions of the search, beside the start."""
    if not conditions:
        return
    from optisense.search.study.conditions import shown

    table = table_of("condition", "start", "trial", "margin")
    for each in conditions:
        margin = shown(each.margin) if each.met else "broken"
        table.add_row(each.text, shown(each.before), shown(each.value), margin)
    output.print(table)
