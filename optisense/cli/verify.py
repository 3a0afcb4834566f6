"""``optisense verify``: compare two sensors on objects that no score has used."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import typer

from optisense.cli.console import (
    EXIT_INTERRUPTED,
    handles_errors,
    messages,
    output,
    print_json,
    print_notes,
    table_of,
)
from optisense.cli.options import VariantOption, json_option, out_option
from optisense.cli.output_folder import take_folder
from optisense.cli.progress import progress_line
from optisense.cli.sampling import BUILDING, LOADING, sample_progress
from optisense.commands.sampling import VerifyOptions
from optisense.writing import write_json, write_text

if TYPE_CHECKING:
    from optisense.design import SensorDesign
    from optisense.optics import OpticalModel
    from optisense.search.study.conditions import ConditionResult
    from optisense.tasks import Verification

JSON_FILE = "verify.json"
REPORT_FILE = "verify.html"
KEPT_FOLDER = "presses"
"""Subfolder of --out in which what was read from each press is kept while the command runs."""

MARK = (JSON_FILE, '"reading_nothing"')
"""File of each verification, and a text in it, by which the folder of an earlier one is
recognised."""


@handles_errors
def verify(
    first: Annotated[
        str,
        typer.Argument(
            metavar="STUDY|DESIGN",
            help="The folder of a search (its --out), whose best trial is compared with its start; "
            "or a design, by the folder or the name of a built-in sensor.",
        ),
    ],
    second: Annotated[
        str | None,
        typer.Argument(
            metavar="[DESIGN]",
            help="The design that is compared with the first one.",
        ),
    ] = None,
    trial: Annotated[
        str, typer.Option(metavar="best|NUMBER", help="With a study: the trial that is compared.")
    ] = "best",
    *,
    options: VerifyOptions,
    out: Annotated[Path | None, out_option("Folder for verify.json and verify.html.")] = None,
    as_json: Annotated[bool, json_option("Print JSON instead of a table.")] = False,
    variant: VariantOption = "auto",
) -> None:
    """Test whether a sensor reads shapes better than another, on objects that no score uses.

    Both sensors are calibrated with presses of balls. Then screws, coins, letters and other objects
    are pressed into both at the same places, and the errors of normals and depth are compared. If
    the command was interrupted, the same command continues from the presses that it kept in --out.
    """
    compared = compare(first, second, trial, options, out, variant)
    if as_json:
        print_json(compared.to_dict())
        return
    print_comparison(compared, out)


class ComparisonResult(NamedTuple):
    """Result of a comparison.

    Attributes:
        found: errors of what is read from both sensors.
        conditions: conditions of the study, and how the trial meets them.
    """

    found: Verification
    conditions: list[ConditionResult]

    def to_dict(self) -> dict[str, Any]:
        """Return the result, ready for JSON."""
        plain = self.found.to_dict()
        if self.conditions:
            plain["conditions"] = [
                {
                    "condition": each.text,
                    "start": each.before,
                    "trial": each.value,
                    "margin": each.margin,
                }
                for each in self.conditions
            ]
        return plain


def compare(
    first: str,
    second: str | None,
    trial: str,
    options: VerifyOptions,
    out: Path | None,
    variant: str,
) -> ComparisonResult:
    """Compare two designs, or a trial of a study with its start; see `verify`.

    Raises:
        OptiSenseError: there are no two designs, or one can't be read.
        typer.BadParameter: only one design is named.
    """
    count = options.pictures()
    with progress_line() as line:
        line.begin(LOADING)
        settings = options.settings()
        names, designs, conditions = _designs(first, second, trial)
        if out is not None:
            take_folder(out, (JSON_FILE, REPORT_FILE), MARK)
        line.begin(BUILDING)
        models = [
            _model(name, design, variant) for name, design in zip(names, designs, strict=True)
        ]
        from optisense.kept_arrays import KeptArrays
        from optisense.tasks import verify as compared_by_objects

        shown: dict[int, Any] = {}

        def show(side: int, done: int, of: int) -> None:
            if side not in shown:
                after = "reading the other sensor" if side == 0 else "comparing"
                shown[side] = sample_progress(line, models[side], SIDES[side], after)
            shown[side](done, count)

        kept = KeptArrays(None if out is None else out / KEPT_FOLDER)
        try:
            found = compared_by_objects((models[0], models[1]), settings, names, show, kept)
        except KeyboardInterrupt:
            if out is None:
                raise
            messages.print("interrupted: the same command continues; finished presses are kept")
            raise typer.Exit(EXIT_INTERRUPTED) from None
        compared = ComparisonResult(found, conditions)
        if out is not None:
            from optisense.report.verification import render_verification

            write_json(out / JSON_FILE, compared.to_dict())
            first_axes, second_axes = (design.camera.axes() for design in designs)
            page = render_verification(found, (first_axes, second_axes))
            write_text(out / REPORT_FILE, page)
            kept.remove()
    return compared


def print_comparison(compared: ComparisonResult, out: Path | None) -> None:
    """Print the errors of both sensors, the conditions, and the files that were written."""
    print_verification(compared.found)
    print_conditions(compared.conditions)
    if out is not None:
        for name in (JSON_FILE, REPORT_FILE):
            output.print(f"written: {out / name}")


SIDES = ("first sensor", "second sensor")
"""Steps of the progress in which each sensor is pressed."""


def _designs(
    first: str, second: str | None, trial: str
) -> tuple[tuple[str, str], tuple[SensorDesign, SensorDesign], list[ConditionResult]]:
    """Return the names and the designs that are compared, and the results of the trial's
    conditions, which are empty without a study.
    """
    from optisense.errors import SearchError
    from optisense.search import Study
    from optisense.search.study.conditions import condition_results
    from optisense.search.study.settings import STUDY_FILE
    from optisense.sensors import load

    if second is not None:
        if trial != "best":
            raise typer.BadParameter("it needs a study", param_hint="--trial")
        one, other = load(first), load(second)
        names = (first, second) if one.name == other.name else (one.name, other.name)
        return names, (one, other), []
    if not (Path(first) / STUDY_FILE).is_file():
        if not Path(first).exists():
            load(first)  # raises if there is no built-in sensor of this name
        raise typer.BadParameter(
            f"'{first}' is no study; name a second design to compare it with", param_hint="DESIGN"
        )
    with closing(Study.open(first)) as study:
        chosen = study.trial(trial)
        if chosen.is_start:
            raise SearchError(
                "no trial is better than the start, so there is nothing to compare",
                where=first,
                hint="Search on, choose a --trial NUMBER, or name two designs",
            )
        names = ("the start", f"trial {chosen.number}")
        conditions = condition_results(chosen.conditions, chosen, study.start)
        return names, (study.space.design, chosen.design), conditions


def _model(name: str, design: SensorDesign, variant: str) -> OpticalModel:
    """Return the optical model of a sensor; errors name the sensor."""
    from optisense.errors import OptiSenseError, SetupError, TaskError
    from optisense.optics import OpticalModel

    try:
        return OpticalModel(design, variant)
    except SetupError:
        raise
    except OptiSenseError as error:
        raise TaskError(
            f"no picture of {name} can be taken: {error.message}",
            where=error.where,
            hint=error.hint,
        ) from error


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
