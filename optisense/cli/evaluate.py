"""``optisense evaluate``: score a sensor by one objective or several."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from optisense.cli.console import (
    EXIT_FAILURE,
    EXIT_INTERRUPTED,
    handles_errors,
    messages,
    output,
    print_json,
    print_notes,
    table_of,
)
from optisense.cli.options import (
    DesignArgument,
    VariantOption,
    json_option,
    out_option,
    print_summaries,
)
from optisense.cli.output_folder import take_folder
from optisense.cli.progress import progress_line
from optisense.cli.sampling import BUILDING, LOADING
from optisense.commands.scoring import EvaluateOptions
from optisense.writing import remove_own_page, write_json

if TYPE_CHECKING:
    from optisense.objectives import Objective
    from optisense.objectives.score import Scored

JSON_FILE = "scores.json"
REPORT_FILE = "scores.html"

MARK = (JSON_FILE, '"shared_seconds"')
"""File of all scores, and a text in it, by which the folder of earlier ones is recognised."""


@handles_errors
def _print_objectives(wanted: bool) -> None:
    if wanted:
        from optisense.objectives.registry import OBJECTIVES

        print_summaries(OBJECTIVES)
        raise typer.Exit


@handles_errors
def evaluate(
    design: DesignArgument,
    *,
    options: EvaluateOptions,
    out: Annotated[Path | None, out_option("Folder for scores.json.")] = None,
    report: Annotated[
        bool,
        typer.Option("--report", help="Also write scores.html, with figures, into the folder."),
    ] = False,
    as_json: Annotated[bool, json_option("Print JSON with all parts instead of a table.")] = False,
    variant: VariantOption = "auto",
    list_objectives: Annotated[
        bool,
        typer.Option(
            "--objectives",
            callback=_print_objectives,
            is_eager=True,
            help="List the objectives and exit.",
        ),
    ] = False,
) -> None:
    """Score a sensor: how well its images show the shape of what touches it.

    Objectives share images and rays. If one fails, the output says why, the others are still
    evaluated, and the exit code is 1.
    """
    if report and out is None:
        raise typer.BadParameter("needs a folder: --out DIR", param_hint="--report")
    settings, seeds = options.for_objectives(), options.seeds

    interrupted = False
    with progress_line() as line:
        line.begin(LOADING)
        from optisense.objectives import BUILT_IN, Settings
        from optisense.objectives.combined import resolve
        from optisense.objectives.run import Scoring, split_settings
        from optisense.sensors import load

        objectives = resolve(options.objectives or BUILT_IN)
        shared, _ = split_settings(settings, objectives)
        sizes = Settings(**shared)
        sensor = load(design)
        print_notes(sensor.camera.shape_notes(sizes.resolution, sizes.ray_resolution))
        if out is not None:
            take_folder(out, (JSON_FILE, *([REPORT_FILE] if report else [])), MARK)

        from optisense.objectives.score import Scored
        from optisense.optics import OpticalModel

        scored = Scored(sensor)
        line.begin(BUILDING)
        model = OpticalModel(sensor, variant=variant)
        line.begin("scoring", seeds)
        try:
            for number in range(seeds):
                of = f"seed {number + 1} of {seeds}, " if seeds > 1 else ""

                def show(
                    done: float, title: str, step: str, number: int = number, of: str = of
                ) -> None:
                    line.advance(number + done)
                    line.say(f"{of}{title}: {step}" if step else f"{of}{title}")

                seed_of_run = {**settings, "seed": options.seed + number}
                scoring = Scoring(model, objectives, seed_of_run, show)
                scores = scored.add(scoring.evaluation)
                for score in scoring:
                    scores[score.objective] = score
        except KeyboardInterrupt:
            if not scored.scores:
                raise
            interrupted = True
    if out is not None:
        _write(scored, out, objectives if report else [])
    if as_json:
        print_json(scored.to_dict())
    else:
        _print_table(scored)
        if out is not None:
            output.print(f"scores: {out / JSON_FILE}")
            if report:
                output.print(f"report: {out / REPORT_FILE}")
    if interrupted:
        messages.print("interrupted: only these scores are finished")
        raise typer.Exit(EXIT_INTERRUPTED)
    if scored.failed():
        raise typer.Exit(EXIT_FAILURE)


def _write(scored: Scored, folder: Path, objectives: list[Objective]) -> None:
    """Write the JSON file, and the page if there are objectives to explain in it."""
    from optisense.report.scores import write_score_report

    write_json(folder / JSON_FILE, scored.to_dict())
    if objectives:
        write_score_report(folder / REPORT_FILE, scored, objectives)
    else:  # a page of earlier scores would contradict these
        remove_own_page(folder / REPORT_FILE, "scores")


def _print_table(scored: Scored) -> None:
    from rich.text import Text

    several = len(scored.runs) > 1
    table = table_of("objective", "score", *(["spread"] if several else []), "seconds")
    table.add_column("")
    for name, score in scored.scores.items():
        shown: str | Text
        if score.failure is not None:
            shown, note = Text("failed", style="red"), ""
        else:
            shown, note = f"{scored.mean(name):.4g}", scored.beside(name)
        row: list[str | Text] = [score.name, shown]
        if several:
            spread = scored.spread(name)
            row.append("" if spread is None else f"± {spread:.2g}")
        table.add_row(*row, f"{score.seconds:.2f}", note)
    output.print(table)
    for score in scored.scores.values():
        if score.failure is not None:
            output.print(f"{score.name} failed: {score.failure}")
