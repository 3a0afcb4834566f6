"""``optisense search``: look for a better design, and keep everything that was tried."""

from __future__ import annotations

import json
import sys
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from optisense.cli import stopping
from optisense.cli.asking import ask_yes
from optisense.cli.console import EXIT_INTERRUPTED, ends_well, messages, output
from optisense.cli.options import (
    SettingOption,
    VariantOption,
    WorkersOption,
    out_option,
    parse_settings,
    seed_option,
)
from optisense.cli.search_result import print_result, summary
from optisense.cli.searching import search_progress

if TYPE_CHECKING:
    from optisense.search import Study


@ends_well
def search(
    design: Annotated[
        str | None,
        typer.Argument(
            metavar="[DESIGN]",
            help="A built-in sensor's name or the folder of a design. May be left out with "
            "--resume.",
            show_default=False,
        ),
    ] = None,
    vary: Annotated[
        list[str] | None,
        typer.Option(
            "--vary",
            metavar="PATH=LO:HI[:N]",
            help="What may change: between two bounds (N values of it for a grid), or around what "
            "it is now as PATH=+-REACH, or one of several as PATH=NAME,NAME. May be given several "
            "times.",
            show_default=False,
        ),
    ] = None,
    objective: Annotated[
        list[str] | None,
        typer.Option(
            "--objective",
            "-b",
            metavar="NAME",
            help="What to maximise: rgb2normal, normdiff, aoap, 2to3pw, or your own as "
            "FILE.py:FUNCTION. Given several times, the first is maximised and the others are "
            "told, or all are weighed by --method pareto.",
            show_default=False,
        ),
    ] = None,
    method: Annotated[
        str | None,
        typer.Option(
            metavar="NAME", help="How to search; --methods lists them.", show_default="cma-es"
        ),
    ] = None,
    budget: Annotated[
        int | None,
        typer.Option(
            min=1,
            metavar="N",
            help="Trials in all; the method's own idea when left out. With --resume, trials "
            "including those that are finished.",
            show_default=False,
        ),
    ] = None,
    workers: WorkersOption = 1,
    cluster: Annotated[
        str | None,
        typer.Option(
            metavar="ADDRESS",
            help="A Dask scheduler whose workers do the trials, such as tcp://192.0.2.7:8786.",
            show_default=False,
        ),
    ] = None,
    out: Annotated[Path | None, out_option("The study's folder.", "STUDY")] = None,
    resume: Annotated[
        bool, typer.Option("--resume", help="Go on with the study in --out.")
    ] = False,
    trust: Annotated[
        bool,
        typer.Option(
            "--trust",
            help="With --resume: run the Python files that the study names, also where it was not "
            "begun by you on this machine and you don't name them again.",
        ),
    ] = False,
    seed: Annotated[
        int | None, seed_option("The same seed gives the same search.", show_default="0")
    ] = None,
    setting: SettingOption = None,
    option: Annotated[
        list[str] | None,
        typer.Option(
            "--option",
            metavar="NAME=VALUE",
            help="An option of the method, such as sigma=0.1 or population=20. May be given "
            "several times.",
            show_default=False,
        ),
    ] = None,
    rule: Annotated[
        list[str] | None,
        typer.Option(
            "--rule",
            metavar="FILE.py:FUNCTION",
            help="A function of a design that returns False, or why, for one that must not be. "
            "May be given several times.",
            show_default=False,
        ),
    ] = None,
    may_cross: Annotated[
        bool,
        typer.Option(
            "--may-cross",
            help="Let parts cut through one another, leave those on which they rest, and "
            "outgrow the sensor.",
        ),
    ] = False,
    error: Annotated[
        list[str] | None,
        typer.Option(
            "--error",
            metavar="PATH=SIZE",
            help="A manufacturing error (standard deviation). With one or more, what nine of ten "
            "manufactured sensors reach is maximised.",
            show_default=False,
        ),
    ] = None,
    samples: Annotated[
        int | None,
        typer.Option(
            min=2, metavar="N", help="Manufactured sensors a trial, with --error.", show_default="8"
        ),
    ] = None,
    variant: VariantOption = "auto",
    as_json: Annotated[
        bool, typer.Option("--json", help="Print the result as JSON instead of text.")
    ] = False,
    methods: Annotated[bool, typer.Option("--methods", help="List the methods and exit.")] = False,
) -> None:
    """Search for a better design.

    Every trial is kept in the study's folder as it finishes. A search that was stopped, or killed,
    goes on with --resume exactly as it would have without.
    """
    if methods:
        _print_methods()
        return
    if out is None:
        raise typer.BadParameter("name a folder for the study", param_hint="--out")

    given = partial(
        _given, vary, objective, method, seed, setting, option, rule, may_cross, error, samples
    )
    with ExitStack() as stack:
        # It may ask whether code is trusted, so it comes before the progress.
        study = _resumed(out, design, given(), trust) if resume else None
        with search_progress(workers if cluster is None else 0) as show:
            from optisense.search import run_study

            if study is None:
                study = _begun(out, design, budget, given())
            stack.callback(study.close)
            result = run_study(
                study,
                workers=workers,
                cluster=cluster,
                limit=budget,
                variant=variant,
                progress=show,
                told=stopping.say,
            )
        if as_json:
            print(json.dumps(summary(result), indent=2, allow_nan=False))
        else:
            print_result(result, out)
    if result.interrupted:
        messages.print(
            f"interrupted: everything is kept; go on with: optisense search --resume --out {out}",
            markup=False,
        )
        raise typer.Exit(EXIT_INTERRUPTED)


def _given(
    vary: list[str] | None,
    objective: list[str] | None,
    method: str | None,
    seed: int | None,
    setting: list[str] | None,
    option: list[str] | None,
    rule: list[str] | None,
    may_cross: bool,
    error: list[str] | None,
    samples: int | None,
) -> dict[str, Any]:
    """What the user gave, read, as arguments of `optisense.search.Plan`."""
    from optisense.search.space.constraints import UserRule
    from optisense.search.space.text import parse_errors, parse_space

    found: dict[str, Any] = {
        "space": parse_space(vary) if vary else None,
        "goals": objective or None,
        "method": method,
        "seed": seed,
        "settings": parse_settings(setting) or None,
        "options": _options(option) or None,
        "rules": [UserRule(text) for text in rule] if rule else None,
        "apart": False if may_cross else None,
        "errors": parse_errors(error) if error else None,
        "samples": samples,
    }
    return {key: value for key, value in found.items() if value is not None}


def _begun(out: Path, design: str | None, budget: int | None, given: dict[str, Any]) -> Study:
    """A new study of what was given."""
    from optisense.search import Plan, SearchSpace, Study
    from optisense.sensors import load

    if design is None:
        raise typer.BadParameter("name the design to start from", param_hint="DESIGN")
    for key, name in (("space", "--vary"), ("goals", "--objective")):
        if key not in given:
            raise typer.BadParameter("must be given at least once", param_hint=name)
    rules = given.pop("rules", ())
    for rule in rules:
        rule.load()  # a missing file is told now, not by trials that fail
    space = SearchSpace(given.pop("space"), rules)
    return Study.create(out, load(design), Plan(space=space, budget=budget, **given))


def _resumed(out: Path, design: str | None, given: dict[str, Any], trust: bool) -> Study:
    """The study in a folder; what was given as well must be what it was begun with."""
    from optisense.search import SearchSpace, Study
    from optisense.search.study.plan import reference, rule_reference
    from optisense.search.study.trust import not_trusted
    from optisense.sensors import load

    study = Study.open(out, None if design is None else load(design))
    wanted = {key: given[key] for key in given if key in ("method", "seed", "samples", "apart")}
    for key in ("settings", "options"):
        if key in given:
            wanted[key] = given[key]
    if "space" in given:
        wanted["space"] = SearchSpace(given["space"]).to_plain()
    if "goals" in given:
        wanted["objectives"] = [reference(goal) for goal in given["goals"]]
    if "rules" in given:
        wanted["rules"] = [rule_reference(rule) for rule in given["rules"]]
    if "errors" in given:
        wanted["errors"] = given["errors"].to_plain()
    study.expect(wanted)
    named = {*wanted.get("objectives", ()), *wanted.get("rules", ())}
    strange = [each for each in not_trusted(study.references) if each not in named]
    if trust or not strange or _may_run(strange):
        study.trust()
    return study


def _may_run(strange: list[str]) -> bool:
    """Ask whether Python code that the user has not named may be run; no where nobody answers."""
    if not (sys.stdin.isatty() and sys.stderr.isatty()):
        return False
    messages.print("This study runs Python code that you have not named:", style="yellow")
    for each in strange:
        messages.print(f"  {each}", markup=False)
    return ask_yes("Do you trust it", default=False)


def _options(texts: list[str] | None) -> dict[str, Any]:
    try:
        return parse_settings(texts)
    except typer.BadParameter as error:
        error.param_hint = "--option"
        raise


def _print_methods() -> None:
    from optisense.search.methods import find, names

    for name in names():
        output.print(f"{name:<14} {find(name).summary}", markup=False)
