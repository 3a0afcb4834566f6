"""``optisense evaluate``: how good a sensor is, by one objective or several."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from optisense.cli.console import (
    EXIT_FAILURE,
    EXIT_INTERRUPTED,
    ends_well,
    messages,
    output,
)
from optisense.cli.options import (
    DesignArgument,
    ScorePhotonsOption,
    ScoreResolutionOption,
    SettingOption,
    VariantOption,
    out_option,
    score_settings,
    seed_option,
)
from optisense.cli.output_folder import take_folder
from optisense.writing import remove_own_page, write_text

if TYPE_CHECKING:
    from optisense.objectives import Objective
    from optisense.objectives.scored import Scored
    from optisense.optics import OpticalModel

JSON_FILE = "scores.json"
REPORT_FILE = "scores.html"


@ends_well
def evaluate(
    design: DesignArgument,
    objective: Annotated[
        list[str] | None,
        typer.Option(
            "--objective",
            "-b",
            metavar="NAME",
            help="rgb2normal, normdiff, aoap, 2to3pw, one that an installed package brings, or "
            "your own as FILE.py:FUNCTION. May be given several times.  [default: all four]",
            show_default=False,
        ),
    ] = None,
    setting: SettingOption = None,
    resolution: ScoreResolutionOption = None,
    photons: ScorePhotonsOption = None,
    seed: Annotated[int, seed_option("The same seed gives the same scores.")] = 0,
    seeds: Annotated[
        int,
        typer.Option(min=1, metavar="N", help="Score with so many seeds, and tell the spread."),
    ] = 1,
    out: Annotated[Path | None, out_option("Folder for scores.json.")] = None,
    report: Annotated[
        bool,
        typer.Option("--report", help="Also write scores.html, with figures, into the folder."),
    ] = False,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print JSON with all parts instead of a table.")
    ] = False,
    variant: VariantOption = "auto",
) -> None:
    """Score a sensor: how well its images tell the shape of what touches it.

    Objectives share images and rays. One that fails says why, the others go on, and the exit
    code is 1.
    """
    if report and out is None:
        raise typer.BadParameter("needs a folder: --out DIR", param_hint="--report")
    settings = score_settings(setting, photons, resolution)

    from optisense.objectives import BUILT_IN, Settings
    from optisense.objectives.registry import resolve
    from optisense.objectives.run import split_settings
    from optisense.sensors import load

    objectives = resolve(objective or BUILT_IN)
    shared, _ = split_settings(settings, objectives)
    Settings(**shared)
    sensor = load(design)
    if out is not None:
        take_folder(out)

    from optisense.objectives.scored import Scored
    from optisense.optics import OpticalModel

    scored = Scored(sensor)
    interrupted = False
    with _progress_bar() as show:
        show(0.0, "preparing the scene")
        model = OpticalModel(sensor, variant=variant)
        try:
            for number in range(seeds):
                _score(model, objectives, {**settings, "seed": seed + number}, scored, show)
        except KeyboardInterrupt:
            if not scored.scores:
                raise
            interrupted = True
    if out is not None:
        _write(scored, out, objectives if report else [])
    if as_json:
        print(json.dumps(scored.to_dict(), indent=2, allow_nan=False))
    else:
        _print_table(scored)
        if out is not None:
            output.print(f"scores: {out / JSON_FILE}", markup=False)
            if report:
                output.print(f"report: {out / REPORT_FILE}", markup=False)
    if interrupted:
        messages.print("interrupted: these are the scores finished until then")
        raise typer.Exit(EXIT_INTERRUPTED)
    if scored.failed():
        raise typer.Exit(EXIT_FAILURE)


def _score(
    model: OpticalModel,
    objectives: list[Objective],
    settings: dict[str, Any],
    scored: Scored,
    show: Callable[[float, str], None],
) -> None:
    """Score with one seed, objective by objective, so that Ctrl-C keeps what is finished."""
    from optisense.objectives import Evaluation, Settings
    from optisense.objectives.registry import pixels_read
    from optisense.objectives.run import run_objective, split_settings

    shared, own = split_settings(settings, objectives)
    evaluation = Evaluation(model, Settings(**shared), show, pixels_read(objectives, own))
    scores = scored.add(evaluation)
    for each in objectives:
        show(0.0, each.title)
        scores[each.name] = run_objective(each, evaluation, own[each.name])


def _write(scored: Scored, folder: Path, objectives: list[Objective]) -> None:
    """The JSON file, and the page if there are objectives to explain in it."""
    from optisense.report.scores import write_score_report

    text = json.dumps(scored.to_dict(), indent=2, allow_nan=False) + "\n"
    write_text(folder / JSON_FILE, text)
    if objectives:
        write_score_report(folder / REPORT_FILE, scored, objectives)
    else:  # a page of earlier scores would contradict these
        remove_own_page(folder / REPORT_FILE, "scores")


def _print_table(scored: Scored) -> None:
    from rich.table import Table

    table = Table(box=None, pad_edge=False)
    table.add_column("objective")
    table.add_column("score", justify="right")
    if len(scored.runs) > 1:
        table.add_column("spread", justify="right")
    table.add_column("seconds", justify="right")
    table.add_column("")
    for name, score in scored.scores.items():
        if score.failure is not None:
            shown, note = "[red]failed[/red]", ""
        else:
            shown, note = f"{scored.mean(name):.4g}", scored.beside(name)
        row = [score.name, shown]
        if len(scored.runs) > 1:
            spread = scored.spread(name)
            row.append("" if spread is None else f"± {spread:.2g}")
        table.add_row(*row, f"{score.seconds:.2f}", note)
    output.print(table)
    for score in scored.scores.values():
        if score.failure is not None:
            output.print(f"{score.name} failed: {score.failure}", markup=False)


@contextmanager
def _progress_bar() -> Iterator[Callable[[float, str], None]]:
    """A bar on standard error; silent when that is no terminal."""
    from rich.progress import TextColumn, TimeElapsedColumn

    from optisense.cli.progress import passing_bar

    with passing_bar("scoring", TextColumn("{task.fields[note]}"), TimeElapsedColumn()) as bar:
        task = bar.add_task("score", total=1.0, note="")

        def show(fraction: float, note: str) -> None:
            bar.update(task, completed=fraction, note=note)

        yield show
