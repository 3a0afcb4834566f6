"""``optisense search``: search for a better design, and keep all trials."""

from __future__ import annotations

import sys
import time
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from optisense.cli import stopping
from optisense.cli.asking import ask_yes
from optisense.cli.console import (
    EXIT_INTERRUPTED,
    handles_errors,
    messages,
    output,
    print_json,
    print_notes,
)
from optisense.cli.options import (
    VariantOption,
    WorkersOption,
    json_option,
    out_option,
    print_summaries,
)
from optisense.cli.search_result import print_result, summary
from optisense.cli.searching import search_progress
from optisense.commands.scoring import SearchOptions
from optisense.errors import OptiSenseError
from optisense.text import argument

if TYPE_CHECKING:
    from optisense.search import Study

VERIFIED_FROM = 300.0
"""Duration of a search, s, from which on it ends with a quick verification by default: that takes
half a minute on two idle cores, which is little beside five minutes.
"""

VERIFY_FOLDER = "verify"
"""Name of the folder for the results of the verification, in that of the study."""


@handles_errors
def search(
    design: Annotated[
        str | None,
        typer.Argument(
            metavar="[DESIGN]",
            help="A built-in sensor's name or the folder of a design. May be left out with "
            "--resume.",
        ),
    ] = None,
    *,
    options: SearchOptions,
    workers: WorkersOption = 1,
    cluster: Annotated[
        str | None,
        typer.Option(
            metavar="ADDRESS",
            help="The address of a Dask scheduler whose workers run the trials, such as "
            "tcp://192.0.2.7:8786.",
        ),
    ] = None,
    out: Annotated[Path | None, out_option("The study's folder.", "STUDY")] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Continue the study in --out.")] = False,
    trust: Annotated[
        bool,
        typer.Option(
            "--trust",
            help="With --resume: run the Python files that the study names, even if you did "
            "not begin it on this machine and do not name them again.",
        ),
    ] = False,
    variant: VariantOption = "auto",
    verify: Annotated[
        bool | None,
        typer.Option(
            "--verify/--no-verify",
            help="Whether to run `optisense verify --quick` at the end, which tests whether the "
            "best design reads better than the start; if left out, only after "
            f"{VERIFIED_FROM / 60:.0f} minutes of searching or more.",
        ),
    ] = None,
    as_json: Annotated[bool, json_option("Print the result as JSON instead of text.")] = False,
    methods: Annotated[bool, typer.Option("--methods", help="List the methods and exit.")] = False,
) -> None:
    """Search for a better design.

    Every finished trial is saved in the study's folder. With --resume, a search that was stopped or
    killed continues with exactly the same trials.
    """
    if methods:
        from optisense.search.methods import METHODS

        print_summaries(METHODS)
        return
    if out is None:
        raise typer.BadParameter("name a folder for the study", param_hint="--out")
    began = time.monotonic()

    is_kept = resume
    try:
        with ExitStack() as stack:
            # It may ask whether code is trusted, so it comes before the progress.
            study = _resumed_study(out, design, options.as_stored(), trust) if resume else None
            with search_progress(workers if cluster is None else 0) as show:
                if study is None:
                    study = _new_study(out, design, options)
                    is_kept = True
                from optisense.search import run_study

                stack.callback(study.close)
                result = run_study(
                    study,
                    workers=workers if cluster is None else cluster,
                    limit=options.budget,
                    variant=variant,
                    progress=show,
                    on_wait=stopping.print_wait,
                )
            best = result.study.best
            better = best is not None and not best.is_start
            if as_json:
                print_json(summary(result))
            else:
                print_result(result, out)
        if result.interrupted:
            raise KeyboardInterrupt
    except KeyboardInterrupt:
        if is_kept:
            messages.print(
                "interrupted: all trials are kept; continue with optisense search --resume --out "
                f"{argument(out)}"
            )
        else:
            messages.print(
                "interrupted before the first trial: no study was kept; give the same command again"
            )
        raise typer.Exit(EXIT_INTERRUPTED) from None
    long = time.monotonic() - began >= VERIFIED_FROM
    if better and not as_json and (long if verify is None else verify):
        _verify(out, variant)


def _verify(study: Path, variant: str) -> None:
    """Verify whether the best design of a study reads better than its start; results go to the
    study's folder.

    Errors are printed, and do not make the search fail.
    """
    from optisense.cli.verify import compare, print_comparison
    from optisense.commands.sampling import VerifyOptions

    folder = study / VERIFY_FOLDER
    full = f"optisense verify {argument(study)}"
    output.print(f"Quick verification of the best design (in full: {full}):")
    try:
        print_comparison(
            compare(
                str(study),
                None,
                "best",
                VerifyOptions.model_validate({"quick": True}),
                folder,
                variant,
            ),
            folder,
        )
    except OptiSenseError as error:
        messages.print(f"the best design can't be verified: {error}", style="yellow")


def _new_study(out: Path, design: str | None, options: SearchOptions) -> Study:
    """Return a new study of the given options."""
    from optisense.sensors import load

    if design is None:
        raise typer.BadParameter("name the design to start from", param_hint="DESIGN")
    for given, name in ((options.vary, "--vary"), (options.objectives, "--objective")):
        if not given:
            raise typer.BadParameter("must be given at least once", param_hint=name)
    sensor = load(design)
    from optisense.search import Study
    from optisense.search.study.advice import advice

    plan = options.plan()
    hint = advice(plan.space.parameters, options.objectives)
    if hint is not None:
        messages.print(f"hint: {hint}", style="yellow")
    study = Study.create(out, sensor, plan)
    print_notes(study.shape_notes)
    return study


def _resumed_study(out: Path, design: str | None, wanted: dict[str, Any], trust: bool) -> Study:
    """Return the study in a folder, after a check that given options are those of its start."""
    from optisense.search import Study
    from optisense.search.study.trust import not_trusted
    from optisense.sensors import load

    study = Study.open(out, None if design is None else load(design))
    study.expect(wanted)
    named = {*wanted.get("objectives", ()), *wanted.get("rules", ())}
    strange = [each for each in not_trusted(study.references) if each not in named]
    if trust or not strange or _ask_trust(strange):
        study.trust()
    return study


def _ask_trust(strange: list[str]) -> bool:
    """Ask whether Python code that the user has not named may be run; False without a terminal."""
    if not (sys.stdin.isatty() and sys.stderr.isatty()):
        return False
    messages.print("This study runs Python code that you did not name:", style="yellow")
    for each in strange:
        messages.print(f"  {each}")
    return ask_yes("Do you trust it", default=False)
